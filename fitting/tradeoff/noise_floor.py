"""What the data themselves leave undecided, in the unit of a fit's error."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable

import msgspec
import numpy as np

from data_formats import Measurement
from fitting import judge
from fitting.diagnostics import data_reciprocity
from fitting.options import FitOptions
from fitting.quantities import count, percent
from fitting.rows import Rows

_SAME_DIRECTION = 1e-5
_LEAST_PAIRS = 20
# Of a normal distribution: the median of the magnitude over the standard deviation.
_MEDIAN_OF_NORMAL = 0.6744897501960817


class NoiseFloor(msgspec.Struct, frozen=True):
    """The error that the true surface itself would have on these data, by one account.

    ``source`` is ``sigma`` (stated in the file), ``repeats`` (directions measured more than
    once) or ``reciprocity`` (directions exchanged, by interpolation, which on a narrow peak
    is an upper bound). ``relative`` is the median relative standard deviation of a value;
    ``error`` what that makes in the objective, RMS over rows, and ``typical`` as the
    geometric mean over angles of incidence, the unit of held-out errors.
    """

    source: str
    relative: float
    error: float
    typical: float
    sentence: str


def noise_floors(
    measurement: Measurement, rows: Rows, objective: str, options: FitOptions
) -> list[NoiseFloor]:
    """Every account that the data allow: sigma, repeats, reciprocity."""
    ways: tuple[Callable[[Measurement, Rows], tuple[np.ndarray, str, str] | None], ...] = (
        _stated,
        _repeated,
        _exchanged,
    )
    found = [way(measurement, rows) for way in ways]
    return [_floor(rows, objective, options, *f) for f in found if f is not None]


def _floor(
    rows: Rows,
    objective: str,
    options: FitOptions,
    sigma: np.ndarray,
    source: str,
    sentence: str,
) -> NoiseFloor:
    """``sigma (n, c)`` as an error: the objective of the values shifted by it.

    Half of the distance between both shifts, since the objectives are not quite linear.
    """
    value = np.where(rows.valid, rows.value, 0.0)
    up, down = (
        judge.residuals(rows, value + sign * sigma, objective, options)
        for sign in (1.0, -1.0)
    )
    r = 0.5 * np.abs(up - down)
    theta = judge.theta_i_of(rows)
    folds = judge.folds(rows) or [np.arange(rows.index.size)]
    each = [judge.angle_error(rows, r, value, theta, held).objective for held in folds]
    size = np.abs(value[rows.valid])
    known = size > 0
    return NoiseFloor(
        source=source,
        relative=float(np.median(sigma[rows.valid][known] / size[known])),
        error=math.sqrt(float(np.sum(r**2)) / max(int(rows.valid.sum()), 1)),
        typical=math.exp(float(np.mean(np.log(np.maximum(each, 1e-300))))),
        sentence=sentence,
    )


def _stated(m: Measurement, rows: Rows) -> tuple[np.ndarray, str, str] | None:
    del m
    if rows.sigma is None:
        return None
    sigma = np.where(rows.valid, rows.sigma, 0.0)
    return sigma, "sigma", "the standard uncertainties that the file states"


def _repeated(m: Measurement, rows: Rows) -> tuple[np.ndarray, str, str] | None:
    """Relative standard deviation of directions that occur more than once, pooled."""
    del m
    g = rows.geometry
    names = ("wix", "wiy", "cos_i", "wox", "woy", "cos_o")
    directions = np.stack([np.asarray(getattr(g, n)) for n in names], axis=1)
    key = np.round(directions / _SAME_DIRECTION).astype(np.int64)
    _, label, many = np.unique(key, axis=0, return_inverse=True, return_counts=True)
    label = label.reshape(-1)
    repeats = int(np.sum(many - 1))
    if repeats < _LEAST_PAIRS:
        return None
    value = np.where(rows.valid, rows.value, 0.0)
    n, total, squares = (np.zeros((many.size, value.shape[1])) for _ in range(3))
    np.add.at(n, label, rows.valid)
    np.add.at(total, label, value)
    mean = total / np.maximum(n, 1)
    np.add.at(squares, label, np.where(rows.valid, value - mean[label], 0.0) ** 2)
    good = (n > 1) & (mean > 0)
    if not good.any():
        return None
    relative = np.sqrt(squares[good] / (n[good] - 1)) / mean[good]
    share = float(np.sqrt(np.sum((n[good] - 1) * relative**2) / np.sum(n[good] - 1)))
    said = f"{count(repeats, 'repeated direction')} in the file"
    return share * np.abs(value), "repeats", said


def _exchanged(m: Measurement, rows: Rows) -> tuple[np.ndarray, str, str] | None:
    """Reciprocity, channel by channel: each of a pair has half of the variance."""
    found = [data_reciprocity(_one_channel(m, c)) for c in range(m.n_channels)]
    pairs = min((n[1] for n in found if n is not None), default=0)
    if pairs < _LEAST_PAIRS:
        return None
    of_channel = np.array([math.nan if n is None else n[0] for n in found])
    of_channel = np.where(np.isnan(of_channel), np.nanmedian(of_channel), of_channel)
    share = of_channel / (math.sqrt(2.0) * _MEDIAN_OF_NORMAL)
    value = np.abs(np.where(rows.valid, rows.value, 0.0))
    said = (
        f"exchanging source and detector, which changes a value by "
        f"{percent(np.median(of_channel))} (median of {count(pairs, 'pair')} per channel, "
        "interpolated)"
    )
    return share * value, "reciprocity", said


def _one_channel(m: Measurement, c: int) -> Measurement:
    return dataclasses.replace(
        m,
        value=m.value[:, c : c + 1],
        valid=m.valid[:, c : c + 1],
        sigma=None if m.sigma is None else m.sigma[:, c : c + 1],
        channels=m.channels[c : c + 1],
    )
