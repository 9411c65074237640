"""ALTA data: parametrisations against vectors, text against binary, and real files."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from test_format_round_trips import measurements

import data_formats
from data_formats import Channel, Measurement, MeasurementError


@pytest.fixture
def read(tmp_path: Path):
    def read_content(content: str | bytes, **options) -> Measurement:
        path = tmp_path / "made.dat"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return data_formats.read(path, **options)

    return read_content


def codes(m: Measurement) -> dict[str, int]:
    return {note.code: note.count for note in m.notes}


def text(param_in: str, rows: list[list[float]], n_y: int = 1, *header: str) -> str:
    lines = ["# made up", f"#DIM {len(rows[0]) - n_y} {n_y}", f"#PARAM_IN {param_in}"]
    lines += [*(header or ["#PARAM_OUT INV_STERADIAN"]), ""]
    return "\n".join(
        [*lines, *("\t".join(repr(float(x)) for x in row) + "\t" for row in rows), ""]
    )


def vectors(m: Measurement) -> tuple[np.ndarray, np.ndarray]:
    """(3, n) light and view."""

    def of(theta, phi):
        return np.stack(
            [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)]
        )

    return of(m.theta_i, m.phi_i), of(m.theta_r, m.phi_r)


def unit(theta: float, phi: float) -> np.ndarray:
    return np.array(
        [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)]
    )


def turned(v: np.ndarray, axis: int, angle: float) -> np.ndarray:
    """Right-handed about the axis with that index."""
    a, b = (axis + 1) % 3, (axis + 2) % 3
    out = np.array(v)
    out[a] = np.cos(angle) * v[a] - np.sin(angle) * v[b]
    out[b] = np.sin(angle) * v[a] + np.cos(angle) * v[b]
    return out


def half(theta_h: float, phi_h: float, theta_d: float, phi_d: float) -> list[np.ndarray]:
    """Light and view; the difference vector is the view's."""
    h, d = unit(theta_h, phi_h), unit(theta_d, phi_d)
    view = turned(turned(d, 1, theta_h), 2, phi_h)
    return [2 * (view @ h) * h - view, view]


L, V = unit(0.4, 0.3), unit(0.7, 1.5)


@pytest.mark.parametrize(
    ("param_in", "x", "light", "view"),
    [
        ("SPHERICAL_TL_PL_TV_PV", [0.4, 0.3, 0.7, 1.5], L, V),
        ("SPHERICAL_TL_PL_TV_PV", [0.4, 0.3, -0.7, 1.5 - np.pi], L, V),
        ("SPHERICAL_TL_PL_TV_PV", [0.4, 0.3, 2.5, 1.5], L, unit(2.5, 1.5)),
        ("ISOTROPIC_TV_TL_DPHI", [0.7, 0.4, -1.2], unit(0.4, 0), unit(0.7, 1.2)),
        (
            "ISOTROPIC_TL_TV_PROJ_DPHI",
            [0.4, 0.7 * np.cos(1.2), 0.7 * np.sin(1.2)],
            unit(0.4, 0),
            unit(0.7, 1.2),
        ),
        (
            "ISOTROPIC_TV_PROJ_DPHI",
            [0.7 * np.cos(1.2), 0.7 * np.sin(1.2)],
            unit(0, 0),
            unit(0.7, 1.2),
        ),
        ("CARTESIAN", [*V, *L], L, V),
        ("RUSIN_TH_PH_TD_PD", [0.3, 0.5, 0.6, 1.1], *half(0.3, 0.5, 0.6, 1.1)),
        ("RUSIN_TH_TD_PD", [0.3, 0.6, 1.1], *half(0.3, 0, 0.6, 1.1)),
        ("RUSIN_TH_TD", [0.3, 0.6], *half(0.3, 0, 0.6, np.pi / 2)),
        ("COS_TH_TD", [np.cos(0.3), np.cos(0.6)], *half(0.3, 0, 0.6, 0)),
        ("COS_TH", [np.cos(0.3)], *half(0.3, 0, 0, 0)),
    ],
)
def test_parametrisations(param_in, x, light, view, read):
    m = read(text(param_in, [[*x, 0.25]]))
    wi, wo = vectors(m)
    if m.phi_i[0] == 0:  # an isotropic sample is turned
        azimuth = np.arctan2(light[1], light[0])
        light, view = turned(light, 2, -azimuth), turned(view, 2, -azimuth)
    np.testing.assert_allclose(wi[:, 0], light, atol=1e-12)
    np.testing.assert_allclose(wo[:, 0], view, atol=1e-12)
    assert m.value.tolist() == [[0.25]]
    assert [c.name for c in m.channels] == ["mono"]
    assert m.provenance.format == "alta"


def test_the_cosine_is_divided_out(read):
    rows = [[0.3, 0.6, 0.0, 0.5], [0.3, 1.56, 0.0, 0.5], [0.3, -0.6, 0.0, 0.5]]
    m = read(text("ISOTROPIC_TL_TV_PROJ_DPHI", rows, 1, f"#PARAM_OUT {'INV_STERADIAN'}"))
    assert m.value.tolist() == [[0.5]] * 3
    header = "#PARAM_OUT INV_STERADIAN_COSINE_FACTOR"
    m = read(text("ISOTROPIC_TL_TV_PROJ_DPHI", rows, 1, header))
    np.testing.assert_allclose(m.value[[0, 2], 0], 0.5 / np.cos(0.6))
    assert m.valid[:, 0].tolist() == [True, False, True]
    assert codes(m)["grazing-masked"] == 1
    # Retro is at dphi = 0, the specular direction opposite.
    np.testing.assert_allclose(np.cos(m.phi_r - m.phi_i), [1, 1, -1])


@pytest.mark.parametrize(("output", "names"), [("RGB_COLOR", "RGB"), ("XYZ_COLOR", "XYZ")])
def test_colours(output, names, read):
    m = read(text("COS_TH", [[0.9, 1, 2, 3]], 3, f"#PARAM_OUT {output}"))
    assert [c.name for c in m.channels] == list(names)
    assert "unit-assumed" in codes(m)
    m = read(text("COS_TH", [[0.9, 1, 2]], 2, f"#PARAM_OUT {output}"))
    assert [c.name for c in m.channels] == ["y_1", "y_2"]


def test_what_the_header_lacks_can_be_said(read):
    made = text("UNKNOWN_INPUT", [[0.5, 0.6, 0.7, 2]], 1, "#SAMPLE 'felt'")
    with pytest.raises(
        MeasurementError, match=r"#PARAM_IN is 'UNKNOWN_INPUT'; supported, also"
    ):
        read(made)
    m = read(made, param_in="ISOTROPIC_TV_TL_DPHI")
    assert (m.theta_i[0], m.theta_r[0]) == (0.6, 0.5)
    assert "unit-assumed" in codes(m)
    m = read(made, param_in="ISOTROPIC_TV_TL_DPHI", param_out="INV_STERADIAN")
    assert "unit-assumed" not in codes(m)


@pytest.mark.parametrize(
    ("header", "extra", "names"),
    [
        ("#VS 0", [], []),
        ("#VS 1", [], []),
        ("#VS 1", [0.1], ["vs_1"]),
        ("#VS 1", [0.1, 0.2], ["vs_1", "vs_2"]),
        ("#VS 2", [0.1, 0.2, 0.3, 0.4], ["vs_1", "vs_2", "vs_3", "vs_4"]),
        ("#VS 0 2", [0.1, 0.2], ["vs_1", "vs_2"]),
    ],
)
def test_intervals_are_kept_but_are_no_uncertainties(header, extra, names, read):
    out = "#PARAM_OUT INV_STERADIAN"
    m = read(
        text("COS_TH", [[0.9, 1, 2, *extra]], 2 + len(extra), out, header).replace(
            f"#DIM 1 {2 + len(extra)}", "#DIM 1 2"
        )
    )
    assert m.value.tolist() == [[1, 2]]
    assert m.sigma is None
    assert list(m.auxiliary) == names
    assert [c[0] for c in m.auxiliary.values()] == extra
    assert ("intervals-kept" in codes(m)) == bool(extra)


def test_half_angles_below_the_horizon_are_left_out(read):
    m = read(text("RUSIN_TH_TD_PD", [[0.2, 0.3, 0, 1], [1.2, 1.2, 0, 2], [0.1, 0.1, 1, 3]]))
    assert m.value[:, 0].tolist() == [1, 3]
    assert codes(m)["below-horizon"] == 1
    with pytest.raises(MeasurementError, match="no row with a valid value is above"):
        read(text("RUSIN_TH_TD_PD", [[1.2, 1.2, 0, 2]]))


def binary(
    rows: np.ndarray, order: str = "<", end: str = "#BEGIN_STREAM\n", **fields
) -> bytes:
    stated = {
        "DIM": "3 1",
        "PARAM_IN": "ISOTROPIC_TV_TL_DPHI",
        "PARAM_OUT": "INV_STERADIAN",
    }
    stated |= {"FORMAT": "binary", "VERSION": "0", "PRECISION": "ieee754-double"}
    stated |= {"SAMPLE_COUNT": f"{len(rows)}", "VS": "0"}
    stated |= {"ENDIAN": "little" if order == "<" else "big"} | fields
    head = "".join(f"#{k} {v}\n" for k, v in stated.items()) + end
    return head.encode() + rows.astype(f"{order}f8").tobytes() + b"\n#END_STREAM\n"


ROWS = np.array([[0.1, 0.2, 0.3, 1.5], [0.4, 0.5, 0.6, -0.5], [0.7, 0.8, 0.9, 2]])


@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize(
    "end", ["#BEGIN_STREAM\n", "#ALTA_END_HEADER\n", "#ALTA_END_HEADER\n#BEGIN_STREAM\n"]
)
def test_binary(order, end, read):
    from_text = read(text("ISOTROPIC_TV_TL_DPHI", ROWS.tolist()))
    assert read(binary(ROWS, order, end)).equals(from_text)
    wide = np.column_stack([ROWS, [7, 8, 9]])
    m = read(binary(wide, order, end, VS="1"))
    assert m.value.tolist() == from_text.value.tolist()
    assert m.auxiliary["vs_1"].tolist() == [7, 8, 9]


GOOD = text("ISOTROPIC_TV_TL_DPHI", ROWS.tolist())


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (GOOD.replace("#DIM 3 1", "#DIM 3"), "#DIM is '3'; expected the numbers"),
        (GOOD.replace("#DIM 3 1", "#DIM 3 99999999999"), "#DIM is '3 9"),
        (GOOD.replace("#DIM 3 1", "#DIM 2 2"), "gives 2 coordinates; .* has 3: theta_v"),
        (
            GOOD.replace("_TV_TL_DPHI", "_TV_TL"),
            "#PARAM_IN is 'ISOTROPIC_TV_TL'; supported",
        ),
        (GOOD.replace("INV_STERADIAN", "ENERGY"), "'ENERGY', which is no BRDF"),
        (GOOD.replace("0.5\t", "", 1), "line 7: the row has 3 fields; expected 4"),
        (GOOD.replace("0.1\t", "", 1), "line 6: the row has 3 fields; expected 4"),
        (
            GOOD.replace("0.5\t", "0.x\t", 1),
            "line 7, column theta_l: '0.x' is not a number",
        ),
        (GOOD.replace("0.5\t", "nan\t", 1), "line 7: 0.4 nan 0.6 is no pair of directions"),
        (GOOD.replace("0.5\t", "3.5\t", 1), "line 7: theta_i is 200"),
        (GOOD + "#VS 3\n", "#VS is '3'; expected 0, 1 or 2"),
        (GOOD[: GOOD.index("0.1")], "no data rows"),
        (text("COS_TH", [[1.1, 1]]), "line 6: 1.1 is no pair"),
        (text("CARTESIAN", [[0, 0, 2, 0, 0, 1, 1]]), "line 6: .* is no pair of directions"),
        (text("COS_TH", [[0.9, float("nan")]]), "none of the 1 values"),
        (binary(ROWS)[:-40], r"3 rows of 4 numbers are 96 bytes, but \d+ follow"),
        (binary(ROWS, SAMPLE_COUNT="10" * 20), "#SAMPLE_COUNT is '1010"),
        (binary(ROWS, SAMPLE_COUNT="-1"), "#SAMPLE_COUNT is '-1'"),
        (binary(ROWS, ENDIAN="middle"), "'middle' endian; expected"),
        (binary(ROWS, end=""), "the header has no end"),
    ],
)
def test_errors(content, message, read):
    with pytest.raises(MeasurementError, match=message) as caught:
        read(content)
    assert "made.dat" in str(caught.value)
    assert "\n" not in str(caught.value)


@settings(
    max_examples=60,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
@given(measurement=measurements())
def test_round_trip_of_what_alta_holds(measurement, tmp_path):
    path = tmp_path / "m.alta"
    whole = measurement.select(measurement.valid.all(axis=1))
    if not whole.n_rows:
        with pytest.raises(MeasurementError, match="no row is valid in every channel"):
            data_formats.write(measurement, path)
        return
    data_formats.write(measurement, path)
    again = data_formats.read(path)
    assert again.equals(replace(whole, sigma=None, auxiliary={}))
    assert again.notes == measurement.notes


def test_the_numbers_alone_say_the_same(tmp_path):
    m = Measurement(
        *(np.array([a, a + 0.1]) for a in (0.2, 0.5, 0.7, 3.0)),
        value=np.array([[1.0, 2, 3], [4, 5, 6]]),
        valid=np.ones((2, 3), bool),
        channels=tuple(map(Channel, "RGB")),
        symmetry="anisotropic",
    )
    path = tmp_path / "m.alta"
    data_formats.write(m, path)
    lines = path.read_text().splitlines()
    path.write_text("\n".join(line for line in lines if "MEASUREMENT_JSON" not in line))
    assert data_formats.read(path).equals(m)
    assert "#PARAM_OUT RGB_COLOR" in lines


def test_twins_in_text_and_binary(real_data: Path):
    name = "alta/brdf_small_simu_two_layers"
    in_text = data_formats.read(real_data / f"{name}_txt.alta")
    in_binary = data_formats.read(real_data / f"{name}_binary.alta")
    assert (in_text.n_rows, in_text.n_channels) == (29, 3)
    np.testing.assert_allclose(in_binary.value, in_text.value, atol=1e-15)
    np.testing.assert_allclose(in_binary.theta_i, in_text.theta_i, atol=1e-15)
    np.testing.assert_allclose(in_binary.phi_r, in_text.phi_r, atol=1e-15)


def test_a_slice_of_pink_felt(real_data: Path):
    m = data_formats.read(real_data / "alta/pink-felt-1d.alta")
    assert (m.n_rows, [c.name for c in m.channels]) == (90, ["R", "G", "B"])
    # The slice through theta_d = 0: source and detector are in one direction.
    np.testing.assert_allclose(m.theta_i, m.theta_r, atol=1e-7)
    np.testing.assert_allclose(np.cos(m.phi_r), 1)
    assert (m.value[:80, 0] > m.value[:80, 2]).all()


def test_retro_reflective_tape(real_data: Path):
    m = data_formats.read(real_data / "alta/retro-3M-jaune.dat")
    assert (m.n_rows, m.provenance.sample) == (7397, "3M Yellow")
    assert codes(m)["grazing-masked"] == np.count_nonzero(~m.valid) == 86
    assert np.unique(np.round(np.rad2deg(m.theta_i))).tolist() == [15, 30, 60]
    wi, wo = vectors(m)
    # As bright straight back as in the mirror direction, and dark between them.
    for theta in (15, 30):
        here = (np.abs(np.rad2deg(m.theta_i) - theta) < 0.1) & m.valid[:, 0]
        back = here & ((wi * wo).sum(axis=0) > np.cos(np.deg2rad(2)))
        mirror = here & ((wi * wo * [[-1], [-1], [1]]).sum(axis=0) > np.cos(np.deg2rad(2)))
        assert m.value[back].max() == pytest.approx(m.value[mirror].max(), rel=0.1)
        assert m.value[back].max() > 20 * np.median(m.value[here])
