"""BSDF XML: values are where Radiance looks for them; glass lets light straight on."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from xml_files import bases, block, document, matrix, random_tree, tree

import data_formats
from data_formats import Measurement, MeasurementError

IN = [(0, 20, 1), (20, 90, 3)]
OUT = [(0, 10, 1), (10, 50, 2), (50, 90, 4)]
WAYS = ["Reflection Front", "Transmission Front", "Reflection Back", "Transmission Back"]


@pytest.fixture
def read(tmp_path: Path):
    def read_text(text: str) -> Measurement:
        path = tmp_path / "made.xml"
        path.write_text(text)
        return data_formats.read(path)

    return read_text


def codes(m: Measurement) -> dict[str, int]:
    return {note.code: note.count for note in m.notes}


def vectors(theta, phi) -> np.ndarray:
    return np.stack(
        [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)]
    )


def in_radiance(m: Measurement) -> tuple[np.ndarray, np.ndarray]:
    """(3, n) wi and wo in the frame of Radiance, whose front is the file's back."""
    turn = np.array([[-1], [1], [-1]])
    return turn * vectors(m.theta_i, m.phi_i), turn * vectors(m.theta_r, m.phi_r)


def numbers() -> np.ndarray:
    return np.arange(28.0).reshape(7, 4) / 100 + 0.05


def klems_text(structure: str = "Columns", ways=WAYS, **kwargs) -> str:
    table = numbers() if structure == "Columns" else numbers().T
    names = ("in", "out") if structure == "Columns" else ("out", "in")
    blocks = [matrix(w, table + k, *names, **kwargs) for k, w in enumerate(ways)]
    return document(structure, *blocks, definition=bases(**{"in": IN, "out": OUT}))


@pytest.mark.parametrize("structure", ["Columns", "Rows"])
def test_matrices(structure, read):
    m = read(klems_text(structure))
    assert m.n_rows == 4 * 28
    assert [c.name for c in m.channels] == ["Visible"]
    wi, wo = in_radiance(m)
    theta_in, phi_in = [0, 55, 55, 55], [0, 0, 120, 240]
    theta_out, phi_out = [0, 30, 30, 70, 70, 70, 70], [0, 0, 180, 0, 90, 180, 270]
    for k, way in enumerate(WAYS):
        side = 1 if way.endswith("Back") else -1
        for r in range(7):
            for c in range(4):
                row = 28 * k + 4 * r + c
                assert m.value[row, 0] == numbers()[r, c] + k
                # An incident patch stands for the direction that the light goes on to.
                x, y, z = vectors(np.deg2rad(theta_in[c]), np.deg2rad(phi_in[c]))
                np.testing.assert_allclose(wi[:, row], [-x, -y, side * z], atol=1e-12)
                out = side if way.startswith("Refl") else -side
                x, y, z = vectors(np.deg2rad(theta_out[r]), np.deg2rad(phi_out[r]))
                np.testing.assert_allclose(wo[:, row], [x, y, out * z], atol=1e-12)
    assert m.from_back.tolist() == ([False] * 56 + [True] * 56)
    assert m.transmitted.tolist() == ([False] * 28 + [True] * 28) * 2


def test_what_it_says(read):
    m = read(klems_text())
    assert codes(m)["transmitted-rows"] == codes(m)["back-incidence"] == 56
    assert {"patch-averages", "front-is-up"} <= set(codes(m))
    assert (m.provenance.sample, m.provenance.format) == ("Opal & glass", "window")
    assert m.provenance.header["SourceSpectrum Visible"] == "D65"
    # An ideal diffuser of reflectance 1 has 1/pi in every patch.
    assert m.auxiliary["projected_solid_angle"][:28:4].sum() == pytest.approx(np.pi)


def test_channels(read):
    ways = [matrix("Reflection Front", numbers(), "in", "out", w) for w in ("Solar", "550")]
    ways += [matrix("Reflection Back", -numbers(), "in", "out", "solar")]
    ways += [
        matrix("Reflection Front", numbers(), "in", "out", w) for w in ("CIE-X", "CIE-u")
    ]
    m = read(document("Columns", *ways, definition=bases(**{"in": IN, "out": OUT})))
    assert [c.name for c in m.channels] == ["Solar", "550 nm", "X"]
    assert m.channels[1].wavelength_nm == 550
    assert m.valid.sum(axis=0).tolist() == [56, 28, 28]
    assert codes(m)["channel-lacking"] == 2 * 28
    assert codes(m)["chromaticity-left-out"] == 1
    assert codes(m)["negative-values"] == 28


@pytest.mark.parametrize(
    ("name", "n"),
    [("LBNL/Klems Full", 145), ("LBNL/Klems Half", 73), ("LBNL/Klems Quarter", 41)],
)
def test_bases_that_every_program_knows(name, n, read):
    m = read(document("Columns", matrix("Reflection Front", np.eye(n), name, name)))
    peaks = m.select(m.value[:, 0] == 1)
    assert peaks.n_rows == n
    np.testing.assert_allclose(peaks.theta_i, peaks.theta_r)
    np.testing.assert_allclose(np.cos(peaks.phi_r - peaks.phi_i), -1)
    assert m.auxiliary["projected_solid_angle"][::n].sum() == pytest.approx(np.pi)


def square(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Shirley and Chiu's map of the disk to the square, as they publish it."""
    out = []
    for u, v in zip(x, y, strict=True):
        r, phi = np.hypot(u, v), np.arctan2(v, u)
        phi += 2 * np.pi * (phi < -np.pi / 4)
        if phi < np.pi / 4:
            a, b = r, phi * r / (np.pi / 4)
        elif phi < 3 * np.pi / 4:
            a, b = -(phi - np.pi / 2) * r / (np.pi / 4), r
        elif phi < 5 * np.pi / 4:
            a, b = -r, (phi - np.pi) * r / (-np.pi / 4)
        else:
            a, b = (phi - 3 * np.pi / 2) * r / (np.pi / 4), -r
        out.append([(a + 1) / 2, (b + 1) / 2])
    return np.array(out).T


def look_up(node: list, position: list[float]) -> float:
    """A tree's value, descending as Radiance does."""
    rank, position = len(position), list(position)
    while isinstance(node[0], list):
        upper = [x >= 0.5 for x in position]
        position = [2 * x - u for x, u in zip(position, upper, strict=True)]
        node = node[sum(u << k for k, u in enumerate(upper))]
    side = round(len(node) ** (1 / rank))
    index = 0
    for x in position:
        index = index * side + int(side * x)
    return node[index]


@pytest.mark.parametrize("rank", [3, 4])
@pytest.mark.parametrize("way", WAYS)
def test_trees(rank, way, read):
    made = [random_tree(rank, np.random.default_rng(k), 2) for k in range(1 << rank)]
    m = read(document(f"TensorTree{rank}", tree(way, made)))
    (xi, yi, zi), (xo, yo, zo) = in_radiance(m)
    assert (np.sign(zi) == (1 if way.endswith("Back") else -1)).all()
    assert (np.sign(zo * zi) == (1 if way.startswith("Refl") else -1)).all()
    if rank == 3:
        turn = (xo + 1j * yo) * np.exp(-1j * np.arctan2(-yi, -xi))
        position = [0.5 - 0.5 * np.hypot(xi, yi), *square(turn.real, turn.imag)]
    else:
        position = [*square(-xi, -yi), *square(xo, yo)]
    found = [look_up(made, list(p)) for p in np.array(position).T]
    assert m.value[:, 0].tolist() == found
    assert m.symmetry == ("isotropic" if rank == 3 else "anisotropic")
    assert m.n_rows > 50
    if rank == 3:
        # All outgoing cells of the directions of incidence around 40 degrees.
        side = np.sqrt(m.auxiliary["projected_solid_angle"] / np.pi)
        at = 0.5 - 0.5 * np.sin(np.deg2rad(40))
        cell = np.abs(0.5 - 0.5 * np.hypot(xi, yi) - at) < side / 2
        wide = cell | (side == 1)
        total = m.auxiliary["projected_solid_angle"][wide].sum()
        assert total == pytest.approx(np.pi)
        assert codes(m)["beyond-grazing"] >= 4


def test_trees_that_differ_between_channels(read):
    one, four = [[0.5]], [[k / 10 for k in range(8)]]
    blocks = [tree("Reflection Front", one[0]), tree("Reflection Front", four[0], "Solar")]
    m = read(document("TensorTree3", *blocks))
    assert m.valid.sum(axis=0).tolist() == [1, 4]
    assert codes(m)["channel-lacking"] == 5
    assert codes(m)["beyond-grazing"] == 4
    # A cell across the middle ends at grazing incidence.
    assert np.sin(m.theta_i[0]) == pytest.approx(0.5)


LAUGHS = (
    '<?xml version="1.0"?><!DOCTYPE lolz [<!ENTITY lol "lol">'
    + "".join(f'<!ENTITY l{k} "{f"&l{k - 1};" * 10}">' for k in range(1, 10))
    + "]><WindowElement>&l9;</WindowElement>"
)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (LAUGHS, r"line 1: .* remove the DOCTYPE"),
        (LAUGHS.replace("&l9;", ""), "remove the DOCTYPE"),
        ('<!DOCTYPE a SYSTEM "file:///etc/passwd"><WindowElement/>', "remove the DOCTYPE"),
        ("<WindowElement>&what;</WindowElement>", "the XML is damaged: undefined entity"),
        ("<WindowElement>", "the XML is damaged"),
        ("<WindowElement>" + "<a>" * 100, "more than 64 elements"),
        ("<WindowElement/>", "0 layers with WavelengthData"),
        ("<a><WindowElement/></a>", "expected a WindowElement"),
        (
            klems_text(ways=["Reflection Left"]),
            "WavelengthDataDirection is 'Reflection Left'",
        ),
        (klems_text(ways=WAYS[:1] * 2), "a second block of reflection front for Visible"),
        (
            klems_text().replace("0.05,", "0.05, 1,", 1),
            r"line \d+: .*29 numbers; expected 7 x 4",
        ),
        (klems_text().replace("0.05,", "0.o5,", 1), "could not convert"),
        (klems_text().replace("<nPhis>3<", "<nPhis>1000000<"), "has 1000001 patches"),
        (
            klems_text().replace("<nPhis>3<", "<nPhis>-3<"),
            "a ring from 20 to 90 degrees with -3",
        ),
        (klems_text().replace("<nPhis>3<", "<nPhis>x<"), "are 20, 90, x; expected two"),
        (
            klems_text().replace("Basis>in<", "Basis>klems<"),
            "is 'klems', which the file does",
        ),
        (klems_text().replace("Columns", "Pillars"), "IncidentDataStructure is 'Pillars'"),
        (klems_text(wavelength="Visible").replace("Visible", ""), "has no Wavelength"),
        (klems_text(wavelength="550").replace("Nanometer", "Inch"), "in the unit 'Inch'"),
        (
            klems_text().replace("</Layer>", "</Layer><Layer><WavelengthData/></Layer>"),
            "2 layers",
        ),
        (document("TensorTree3", tree(WAYS[0], [[1.0]] * 7)), "7 nodes in it; expected 8"),
        (document("TensorTree3", tree(WAYS[0], [[1.0]] * 9)), "more than 8 nodes"),
        (
            document("TensorTree4", tree(WAYS[0], [1.0] * 8)),
            "8 numbers; expected 1, 16, 256",
        ),
        (document("TensorTree3", block(WAYS[0], "", "{1} {2}")), r"'\{2\}' is neither"),
        (document("TensorTree3", block(WAYS[0], "", "{" * 99)), "more than 24 nodes deep"),
        (document("TensorTree3", block(WAYS[0], "", "{ 1")), "the tree|neither"),
        (document("TensorTree3", block(WAYS[0], "", "")), "the tree has no end"),
        (document("TensorTree3", block(WAYS[0], "", "{}")), "0 numbers; expected 1, 8"),
        (document("TensorTree3", block(WAYS[0], "", "{x}")), "could not convert"),
        (document("TensorTree3", block(WAYS[0], "", "{nan}")), "none of the 1 values"),
    ],
)
def test_errors(text, message, read):
    with pytest.raises(MeasurementError, match=message) as caught:
        read(text)
    assert "made.xml" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_utf_16_with_a_document_type_is_refused_as_well(tmp_path):
    path = tmp_path / "made.xml"
    path.write_text(LAUGHS.replace('?xml version="1.0"?', "!-- --"), encoding="utf-16")
    with pytest.raises(MeasurementError, match="remove the DOCTYPE"):
        data_formats.read(path)


def incidences(m: Measurement) -> np.ndarray:
    """(n,) a number for each direction of incidence."""
    cells = np.round(vectors(m.theta_i, m.phi_i), 6).T
    return np.unique(cells, axis=0, return_inverse=True)[1].ravel()


@pytest.mark.parametrize("back", [False, True])
@pytest.mark.parametrize("through", [False, True])
def test_clear_glass(real_data: Path, back, through):
    m = data_formats.read(real_data / "radiance/SingleClear.xml")
    assert [c.name for c in m.channels] == ["Solar", "Visible"]
    assert m.n_rows == 4 * 145 * 145
    m = m.select((m.from_back == back) & (m.transmitted == through))
    wi, wo = vectors(m.theta_i, m.phi_i), vectors(m.theta_r, m.phi_r)
    column = incidences(m)
    assert column.max() == 144
    total = np.bincount(column, m.value[:, 1] * m.auxiliary["projected_solid_angle"])
    for k in range(145):
        rows = np.flatnonzero(column == k)
        top = rows[np.argmax(m.value[rows, 1])]
        straight = -wi[:, top] if through else wi[:, top] * [-1, -1, 1]
        np.testing.assert_allclose(wo[:, top], straight, atol=1e-6)
    # 3 mm clear float glass in the glazing database: Tvis 0.899, Rvis 0.083.
    normal = column[np.argmin(np.sin(m.theta_i))]
    assert total[normal] == pytest.approx(0.899 if through else 0.083, abs=0.002)


@pytest.mark.parametrize("name", ["SingleClear.xml", "2011-SA1.XML"])
def test_no_more_light_leaves_than_came(real_data: Path, name):
    m = data_formats.read(real_data / "radiance" / name)
    area = m.auxiliary["projected_solid_angle"]
    for channel in range(2):
        total = np.bincount(incidences(m), m.value[:, channel] * area)
        assert len(total) == 290
        assert 0.4 < total.min() < total.max() < 1


def test_a_shade_lets_light_straight_on(real_data: Path):
    """A tensor tree: the brightest cell is next to the direction of the light."""
    m = data_formats.read(real_data / "radiance/t3.xml")
    assert m.from_back.all()
    assert m.symmetry == "isotropic"
    area = m.auxiliary["projected_solid_angle"]
    wi, wo = vectors(m.theta_i, m.phi_i), vectors(m.theta_r, m.phi_r)
    for degrees in (5, 20, 45, 70):
        cell = np.sqrt(area / np.pi)
        here = np.abs(np.sin(m.theta_i) - np.sin(np.deg2rad(degrees))) <= cell
        for through in (False, True):
            rows = np.flatnonzero(here & (m.transmitted == through))
            assert area[rows].sum() == pytest.approx(np.pi)
            assert 0.02 < (m.value[rows, 0] * area[rows]).sum() < 0.6
        top = rows[np.argmax(m.value[rows, 0])]
        assert m.value[top, 0] > 1000 * np.median(m.value[rows, 0])
        assert np.arccos(wo[:, top] @ -wi[:, top]) < np.deg2rad(1)


def test_the_small_broken_copies_are_refused(real_data: Path):
    broken = sorted((real_data / "radiance").glob("*Small*"))
    assert len(broken) == 3
    for path in broken:
        with pytest.raises(MeasurementError, match="4 numbers; expected 145 x 145 = 21025"):
            data_formats.read(path)
