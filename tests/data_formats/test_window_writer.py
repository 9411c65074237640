"""BSDF XML that is written is read back, and Radiance's own files survive it."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from xml_files import document, random_tree, tree

import data_formats
from data_formats import Measurement, MeasurementError, klems
from data_formats.measurement import PROJECTED_SOLID_ANGLE, Channel
from data_formats.patches import Group


def ordered(m: Measurement) -> Measurement:
    """By directions, whose order the file decides."""
    keys = [np.cos(m.theta_i), np.cos(m.theta_r)]
    keys += [np.sin(t) * f(p) for t, p in ((m.theta_i, m.phi_i), (m.theta_r, m.phi_r))
             for f in (np.cos, np.sin)]  # fmt: skip
    return m.select(np.lexsort(np.round(keys, 7) + 0.0))


def same(first: Measurement, second: Measurement) -> None:
    a, b = ordered(first), ordered(second)
    np.testing.assert_array_equal(a.value, b.value)
    np.testing.assert_allclose(a.theta_i, b.theta_i, atol=1e-12)
    np.testing.assert_allclose(a.theta_r, b.theta_r, atol=1e-12)
    turn = np.abs(np.exp(1j * (a.phi_r - a.phi_i)) - np.exp(1j * (b.phi_r - b.phi_i)))
    assert np.max(turn * np.sin(a.theta_i) * np.sin(a.theta_r)) < 1e-12
    assert a.channels == b.channels


@pytest.mark.parametrize("name", ["SingleClear", "t3"])
def test_files_of_others(real_data, tmp_path, name):
    m = data_formats.read(real_data / "radiance" / f"{name}.xml")
    data_formats.write(m, tmp_path / "again.xml")
    same(m, data_formats.read(tmp_path / "again.xml"))


@pytest.mark.parametrize("rank", [3, 4])
def test_trees(tmp_path, rank):
    rng = np.random.default_rng(rank)
    text = document(
        f"TensorTree{rank}",
        *(tree(f"Reflection {side}", random_tree(rank, rng)) for side in ("Front", "Back")),
    )
    (tmp_path / "made.xml").write_text(text)
    m = data_formats.read(tmp_path / "made.xml")
    data_formats.write(m, tmp_path / "again.xml")
    same(m, data_formats.read(tmp_path / "again.xml"))


def quarter() -> Measurement:
    """A matrix of the smallest basis, with a wavelength and a band."""
    basis = klems.BASES["LBNL/Klems Quarter"]
    patches = klems.pairs(basis, basis)
    group = Group("reflection", "front", patches)
    value = np.random.default_rng(1).random((len(patches.area), 2))
    return Measurement(
        *group.angles(), value=value, valid=np.ones(value.shape, bool),
        channels=(Channel.at(550.0), Channel("Visible")),
        auxiliary={PROJECTED_SOLID_ANGLE: patches.area},
    )  # fmt: skip


def test_matrices(tmp_path):
    data_formats.write(quarter(), tmp_path / "a.xml")
    same(quarter(), data_formats.read(tmp_path / "a.xml"))


def test_what_cannot_be_written_is_said(tmp_path):
    m = quarter()
    masked = m.valid.copy()
    masked[3] = False
    with pytest.raises(MeasurementError, match="no mask, and 2 values"):
        data_formats.write(dataclasses.replace(m, valid=masked), tmp_path / "a.xml")
    some = m.select(np.arange(20))
    with pytest.raises(MeasurementError, match=r"not at the centres of cells|areas of"):
        data_formats.write(some, tmp_path / "a.xml")
    plain = dataclasses.replace(some, auxiliary={})
    with pytest.raises(MeasurementError, match="not at the centres of a Klems basis"):
        data_formats.write(plain, tmp_path / "a.xml")
    assert not list(tmp_path.iterdir())
