"""Transmitted light and samples lit from the back, in every format that holds them."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.io import savemat

import data_formats
from data_formats import Channel, Measurement, MeasurementError

# theta_i, phi_i, theta_r, phi_r in degrees, and a value: reflected and transmitted, in
# front and behind, and the pole behind.
DEGREES = np.array(
    [
        [30, 0, 30, 180, 0.30],
        [30, 0, 150, 180, 0.20],
        [30, 0, 180, 0, 0.10],
        [150, 0, 150, 180, 0.35],
        [150, 0, 30, 180, 0.25],
        [180, 0, 20, 90, 0.15],
        [90, 0, 120, 180, 0.05],
    ]
)
ROWS = np.hstack([np.deg2rad(DEGREES[:, :4]), DEGREES[:, 4:]])
TRANSMITTED = [False, True, True, False, True, True, False]
FROM_BACK = [False, False, False, True, True, True, False]
COUNTS = {"transmitted-rows": 4, "back-incidence": 3}

Rows = np.ndarray


def codes(m: Measurement) -> dict[str, int]:
    return {note.code: note.count for note in m.notes}


def as_astm(path: Path, rows: Rows = ROWS, *header: str) -> Path:
    lines = [*header, f"NUM_POINTS {len(rows)}"]
    lines += ["VARS theta_i,phi_i,theta_s,phi_s,550nm", ""]
    lines += [",".join(map(repr, row)) for row in rows.tolist()]
    path = path / "m.astm"
    path.write_text("\n".join(lines))
    return path


def as_csv(path: Path, rows: Rows = ROWS, *header: str) -> Path:
    lines = [*header, "theta_i_rad,phi_i_rad,theta_r_rad,phi_r_rad,550nm"]
    lines += [",".join(map(repr, row)) for row in rows.tolist()]
    path = path / "m.csv"
    path.write_text("\n".join(lines))
    return path


def as_pbrt(path: Path, rows: Rows = ROWS, *header: str) -> Path:
    lines = [*(f"# {h}" for h in header), "1 550"]
    lines += [" ".join(map(repr, row)) for row in rows.tolist()]
    path = path / "m.brdf"
    path.write_text("\n".join(lines))
    return path


def as_vectors(path: Path, rows: Rows = ROWS) -> Path:
    def vectors(theta, phi):
        return np.column_stack(
            [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)]
        )

    path = path / "m.mat"
    table = {"dir_in": vectors(*rows.T[:2]), "dir_out": vectors(*rows.T[2:4])}
    savemat(path, table | {"fr": rows[:, 4:], "wavelength": np.array([550.0])})
    return path


@pytest.mark.parametrize("make", [as_astm, as_csv, as_pbrt, as_vectors])
def test_every_reader_keeps_and_counts_them(make, tmp_path):
    m = data_formats.read(make(tmp_path))
    np.testing.assert_allclose(m.theta_i, ROWS[:, 0], atol=1e-15)
    np.testing.assert_allclose(m.theta_r, ROWS[:, 2], atol=1e-15)
    assert m.value.tolist() == ROWS[:, 4:].tolist()
    assert m.valid.all()
    assert m.transmitted.tolist() == TRANSMITTED
    assert m.from_back.tolist() == FROM_BACK
    assert COUNTS.items() <= codes(m).items()
    assert not {"perhaps-folded", "folded-transmission", "theta-rounded"} & set(codes(m))


def test_one_sided_files_have_no_such_notes(tmp_path):
    assert not set(COUNTS) & set(codes(data_formats.read(as_astm(tmp_path, ROWS[:1]))))


def test_house_paint_layout_lit_from_the_back(tmp_path):
    theta, phi = np.array([0.0, 30, 120, 180]), np.array([0.0, 90, 180, 270])
    table: dict[str, np.ndarray] = {"wavelengths": np.array([450.0, 550])}
    for incidence in ("30", "120"):
        table |= {f"theta{incidence}": theta, f"phi{incidence}": phi}
        table[f"brdf{incidence}"] = np.arange(8.0).reshape(2, 4)
    savemat(tmp_path / "m.mat", table)
    m = data_formats.read(tmp_path / "m.mat")
    assert set(np.round(np.rad2deg(m.theta_i))) == {30, 120}
    assert COUNTS | codes(m) == codes(m) | {"transmitted-rows": 4, "back-incidence": 4}
    assert m.transmitted.sum() == m.from_back.sum() == 4


@pytest.mark.parametrize("suffix", [".astm", ".csv", ".h5"])
@pytest.mark.parametrize("make", [as_astm, as_csv, as_pbrt, as_vectors])
def test_conversion_loses_nothing(make, suffix, tmp_path):
    m = data_formats.read(make(tmp_path))
    data_formats.write(m, tmp_path / f"again{suffix}")
    again = data_formats.read(tmp_path / f"again{suffix}")
    assert again.equals(m)
    assert (again.notes, again.provenance) == (m.notes, m.provenance)
    assert again.transmitted.tolist() == TRANSMITTED


thetas = st.floats(0, np.pi) | st.sampled_from([0, np.pi / 2, 1.5708, np.pi / 2 + 5e-4])


@pytest.mark.parametrize("suffix", [".astm", ".csv", ".h5"])
@settings(
    max_examples=60,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
@given(data=st.data(), n=st.integers(1, 6))
def test_round_trip_of_sides(suffix, data, n, tmp_path):
    def column(elements):
        return data.draw(arrays(np.float64, n, elements=elements))

    m = Measurement(
        theta_i=column(thetas),
        phi_i=column(st.floats(-7, 7)),
        theta_r=column(thetas),
        phi_r=column(st.floats(-7, 7)),
        value=column(st.floats(-1, 1e5))[:, None],
        valid=np.ones((n, 1), bool),
        channels=(Channel.at(550),),
    )
    path = tmp_path / f"m{suffix}"
    data_formats.write(m, path)
    again = data_formats.read(path)
    assert again.equals(m)
    assert (again.transmitted == m.transmitted).all()
    assert (again.from_back == m.from_back).all()


@pytest.mark.parametrize("suffix", [".astm", ".csv"])
def test_the_numbers_alone_say_the_same(suffix, tmp_path):
    """Without the line that only this program understands."""
    m = data_formats.read(as_astm(tmp_path, ROWS, "MEAS_NAME BTDF"))
    path = tmp_path / f"again{suffix}"
    data_formats.write(m, path)
    path.write_text(re.sub(r"(?m)^.*MEASUREMENT_JSON.*\n", "", path.read_text()))
    again = data_formats.read(path)
    assert again.equals(m)
    assert COUNTS.items() <= codes(again).items()


def test_degrees_and_in_plane_tables(tmp_path):
    path = tmp_path / "m.csv"
    path.write_text("aoi,vza,550nm\n30,-150,0.1\n30,150,0.2\n30,30,0.3\n120,30,0.4\n")
    m = data_formats.read(path)
    np.testing.assert_allclose(np.rad2deg(m.theta_r), [150, 150, 30, 30])
    assert m.phi_r.tolist() == [0, np.pi, np.pi, np.pi]
    assert m.transmitted.tolist() == [True, True, False, True]
    assert {"transmitted-rows": 3, "back-incidence": 1}.items() <= codes(m).items()


def test_near_the_horizon_only_printed_right_angles_are_rounding(tmp_path):
    thetas = [1.5708, 1.571, np.pi / 2 + 1e-7, np.pi / 2 + 4e-4, 2.0]
    rows = [[0.5, 0, theta, 0, 0.1] for theta in thetas]
    m = data_formats.read(as_astm(tmp_path, np.array(rows)))
    assert m.theta_r.tolist() == [np.pi / 2] * 3 + thetas[3:]
    assert m.transmitted.tolist() == [False, False, False, True, True]
    assert codes(m)["theta-rounded"] == 3
    # Nothing is behind the surface here, so a hair below the horizon is on it.
    m = data_formats.read(as_astm(tmp_path, np.array(rows[:4])))
    assert (m.theta_r == np.pi / 2).all()
    assert codes(m)["theta-rounded"] == 4


def test_symmetry_with_a_source_that_goes_round(tmp_path):
    def symmetry(*rows: list[float]) -> str:
        return data_formats.read(as_astm(tmp_path, np.array(rows))).symmetry

    front = [0.5, 0, 0.5, 1, 0.1]
    assert symmetry(front, [0.5, 0, 2.5, -1, 0.1]) == "isotropic"
    assert symmetry(front, [2.5, np.pi, 2.5, np.pi - 1, 0.1]) == "isotropic"
    assert symmetry(front, [2.5, 0, 2.5, -1, 0.1]) == "isotropic"
    assert symmetry(front, [2.5, 1, 2.5, -1, 0.1]) == "anisotropic"
    assert symmetry(front, [np.pi, 1, 2.5, -1, 0.1]) == "bilateral"


def test_zeros_behind_the_surface_are_not_the_hidden_source(tmp_path):
    rows = [
        [np.deg2rad(85), 0, np.deg2rad(t), 0, 0.0 if 88 < t < 100 else 0.1]
        for t in range(60, 120, 2)
    ]
    m = data_formats.read(as_csv(tmp_path, np.array(rows)))
    hidden = ~m.valid[:, 0]
    assert not (hidden & m.transmitted).any()


def test_the_ramp_to_the_horizon_behind_the_surface(write_astm, ramped_rows):
    rows = ramped_rows.copy()
    names = "theta_i,phi_i,theta_s,465nm,525nm,630nm"
    front = data_formats.read(write_astm(rows, names))
    folded = data_formats.read(write_astm(rows, names, ("MEAS_NAME BTDF",)))
    assert folded.transmitted.sum() == (front.theta_r < np.pi / 2 - 1e-9).sum()
    assert (folded.valid == front.valid).all()
    assert codes(folded)["ramp-masked"] == codes(front)["ramp-masked"] == 108


FRONT = np.array([[0.5, 0, 0.6, np.pi, 0.2], [0.5, 0, 0, 0, 0.1], [0.5, 0, 1.2, 0, 0.3]])


@pytest.mark.parametrize(
    ("make", "header"),
    [
        (as_astm, "MEAS_NAME BTDF"),
        (as_astm, "MEAS_NAME Transmission"),
        (as_astm, "LAB_COMMENTS BTDF of an opal glass"),
        (as_csv, "quantity: btdf"),
        (as_csv, "Scatter-Type = BTDF"),
        (as_csv, "BTDF values"),
        (as_csv, "mode: transmission"),
        (as_csv, "A bidirectional transmittance distribution function"),
        (as_csv, "Transmission measurement of opal glass"),
        (as_pbrt, "BTDF of opal glass"),
    ],
)
def test_folded_transmission_is_unfolded(make, header, tmp_path):
    path = make(tmp_path, FRONT, header)
    m = data_formats.read(path)
    np.testing.assert_allclose(m.theta_r, np.pi - FRONT[:, 2], rtol=1e-15)
    assert m.phi_r.tolist() == FRONT[:, 3].tolist()
    assert m.value.tolist() == FRONT[:, 4:].tolist()
    assert m.transmitted.all()
    assert codes(m)["folded-transmission"] == codes(m)["transmitted-rows"] == 3
    for options in ({"side": "as-written"}, {"quantity": "brdf"}):
        kept = data_formats.read(path, **options)
        assert kept.theta_r.tolist() == FRONT[:, 2].tolist()
        assert not {"folded-transmission", "perhaps-folded"} & set(codes(kept))


@pytest.mark.parametrize("make", [as_astm, as_csv, as_pbrt, as_vectors])
@pytest.mark.parametrize("options", [{"side": "transmitted"}, {"quantity": "btdf"}])
def test_the_user_says_that_it_is_folded(make, options, tmp_path):
    path = make(tmp_path, FRONT)
    assert not data_formats.read(path).transmitted.any()
    m = data_formats.read(path, **options)
    assert m.transmitted.all()
    assert m.value.tolist() == FRONT[:, 4:].tolist()
    assert codes(m)["folded-transmission"] == 3


def test_folded_transmission_from_the_back(tmp_path):
    rows = FRONT.copy()
    rows[:, [0, 2]] = np.pi - rows[:, [0, 2]]
    m = data_formats.read(as_astm(tmp_path, rows), side="transmitted")
    np.testing.assert_allclose(m.theta_r, FRONT[:, 2], atol=1e-15)
    assert m.transmitted.all()
    assert m.from_back.all()


@pytest.mark.parametrize(
    "header",
    [
        "Mounted on the transmission stage",
        "Transmission filter: ND 2",
        "Type: transmission diffuser",
        "BRDF and BTDF of an opal glass",
        "BTDF was converted from raw counts",
    ],
)
def test_a_doubtful_header_is_asked_about(header, tmp_path):
    m = data_formats.read(as_csv(tmp_path, FRONT, header))
    assert m.theta_r.tolist() == FRONT[:, 2].tolist()
    assert codes(m)["perhaps-folded"] == 3
    # Where rows are behind the surface, there is nothing to ask.
    assert "perhaps-folded" not in codes(data_formats.read(as_csv(tmp_path, ROWS, header)))


@pytest.mark.parametrize(
    "header", ["MEAS_NAME BRDF", "SAMPLE_NAME BTDF target", "FILE_NAME a_BTDF.astm"]
)
def test_what_says_nothing_about_sides(header, tmp_path):
    m = data_formats.read(as_astm(tmp_path, FRONT, header))
    assert not m.transmitted.any()
    assert m.notes == data_formats.read(as_astm(tmp_path, FRONT)).notes


def test_unfolded_in_part(tmp_path):
    m = data_formats.read(as_astm(tmp_path, ROWS, "MEAS_NAME BTDF"))
    assert m.transmitted.tolist() == TRANSMITTED
    assert codes(m)["perhaps-folded"] == 2
    with pytest.raises(MeasurementError, match="in 2 rows and on the other in 4") as caught:
        data_formats.read(as_astm(tmp_path), side="transmitted")
    assert "m.astm" in str(caught.value)
    # All on the other side as written: nothing to do and nothing to say.
    sound = ROWS[np.array(TRANSMITTED)]
    m = data_formats.read(as_astm(tmp_path, sound, "MEAS_NAME BTDF"), side="transmitted")
    assert m.theta_r.tolist() == sound[:, 2].tolist()
    assert "folded-transmission" not in codes(m)


@pytest.mark.parametrize("suffix", [".astm", ".csv", ".h5"])
def test_what_was_unfolded_stays_so(suffix, tmp_path):
    m = data_formats.read(as_astm(tmp_path, FRONT, "MEAS_NAME BTDF"))
    path = tmp_path / f"again{suffix}"
    data_formats.write(m, path)
    again = data_formats.read(path)
    assert again.equals(m)
    assert (again.notes, again.provenance) == (m.notes, m.provenance)


def test_the_user_overrules_what_this_program_wrote(tmp_path):
    m = data_formats.read(as_astm(tmp_path, FRONT))
    data_formats.write(m, tmp_path / "own.csv")
    again = data_formats.read(tmp_path / "own.csv", quantity="btf")
    assert again.transmitted.all()
    np.testing.assert_array_equal(again.value, m.value / np.pi)
    assert {"folded-transmission", "brf-divided-by-pi"} <= set(codes(again))


def test_options_are_checked(tmp_path):
    with pytest.raises(MeasurementError, match=r"m\.astm: side is 'left'; expected one of"):
        data_formats.read(as_astm(tmp_path), side="left")
