"""How far a fit is from the data, where, and on data that it has not seen."""

from __future__ import annotations

import numpy as np

from fitting.objectives import transform
from fitting.options import FitOptions
from fitting.problem import residual_terms
from fitting.result import AngleError, ChannelError, Scores
from fitting.rows import Rows
from fitting.solid_angle import incidence_labels

_MAX_FOLDS = 10

# Of `Scores`, in words.
MEANING = {
    "l2": "RMS of the distance over channels, 1/sr",
    "l2cos": "RMS, times the cosine, 1/sr",
    "log1p": "RMS of log(1 + f cos)",
    "asinh": "RMS of asinh(f cos / median): relative where bright",
    "cbrt": "RMS of the cube root of f cos / median",
    "chi2_reduced": "mean of (residual / standard uncertainty)^2",
}


def residuals(
    rows: Rows, predicted: np.ndarray, objective: str, options: FitOptions
) -> np.ndarray:
    """Weighted residuals ``(n, c)`` of an objective; zero where the data are not valid."""
    terms = residual_terms(rows, objective, options)
    v = predicted.T * terms.kappa
    return (terms.weight * (transform(objective, v) - terms.target)).T


def l2(rows: Rows, predicted: np.ndarray, among: np.ndarray | None = None) -> float:
    """RMS over rows of the norm over channels of (fit - measured), 1/sr."""
    difference = np.where(rows.valid, predicted - rows.value, 0.0)
    if among is not None:
        difference = difference[among]
    return float(np.sqrt(np.mean(np.sum(difference**2, axis=1))))


def scores(rows: Rows, predicted: np.ndarray, options: FitOptions) -> Scores:
    """The distance in every objective."""
    n = int(rows.valid.sum())

    def rms(objective: str) -> float:
        r = residuals(rows, predicted, objective, options)
        return float(np.sqrt(np.sum(r**2) / n))

    known = rows.sigma is not None or options.noise is not None
    return Scores(
        l2=l2(rows, predicted),
        l2cos=rms("l2cos"),
        log1p=rms("log1p"),
        asinh=rms("asinh"),
        cbrt=rms("cbrt"),
        chi2_reduced=rms("chi2") ** 2 if known else None,
    )


def typical_deviation(predicted: np.ndarray, value: np.ndarray, valid: np.ndarray) -> float:
    """Median relative difference of fit and data ``(n, c)``, averaged over valid channels.

    The same figure as the reciprocity error of the data, so that the two compare.
    """
    count = valid.sum(axis=1)
    there = np.where(valid, predicted, 0.0).sum(axis=1) / count
    here = np.where(valid, value, 0.0).sum(axis=1) / count
    size = 0.5 * (np.abs(there) + np.abs(here))
    good = size > 0
    if not good.any():
        return 0.0
    return float(np.median(np.abs(there - here)[good] / size[good]))


def theta_i_of(rows: Rows) -> np.ndarray:
    """Polar angle of incidence of every row, rad."""
    g = rows.geometry
    return np.arctan2(np.hypot(g.wix, g.wiy), g.cos_i)


def by_angle(
    rows: Rows, predicted: np.ndarray, objective: str, options: FitOptions
) -> list[AngleError]:
    """Errors per polar angle of incidence."""
    r = residuals(rows, predicted, objective, options)
    theta = theta_i_of(rows)
    label = incidence_labels(theta)
    return [
        angle_error(rows, r, predicted, theta, np.flatnonzero(label == k))
        for k in np.unique(label)
    ]


def angle_error(
    rows: Rows,
    residual: np.ndarray,
    predicted: np.ndarray,
    theta: np.ndarray,
    among: np.ndarray,
) -> AngleError:
    """Errors of some rows."""
    n = max(int(rows.valid[among].sum()), 1)
    return AngleError(
        theta_i_deg=float(np.degrees(theta[among].mean())),
        rows=int(among.size),
        objective=float(np.sqrt(np.sum(residual[among] ** 2) / n)),
        l2=l2(rows, predicted, among),
    )


def by_channel(rows: Rows, predicted: np.ndarray, names: list[str]) -> list[ChannelError]:
    """RMS errors per channel in 1/sr, and relative to the RMS of the data."""
    out: list[ChannelError] = []
    for c, name in enumerate(names):
        good = rows.valid[:, c]
        if not good.any():
            out.append(ChannelError(name, None, None))
            continue
        rms = float(np.sqrt(np.mean((predicted[good, c] - rows.value[good, c]) ** 2)))
        size = float(np.sqrt(np.mean(rows.value[good, c] ** 2)))
        out.append(ChannelError(name, rms, rms / size if size > 0 else None))
    return out


def folds(rows: Rows) -> list[np.ndarray]:
    """Rows to hold out, one polar angle of incidence at a time; at most ten groups.

    Empty for data of a single angle of incidence.
    """
    label = incidence_labels(theta_i_of(rows))
    count = int(label.max()) + 1
    if count < 2:
        return []
    groups = np.array_split(np.arange(count), min(count, _MAX_FOLDS))
    return [np.flatnonzero(np.isin(label, g)) for g in groups]
