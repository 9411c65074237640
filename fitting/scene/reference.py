"""The measurement between its samples: what a rendered image is compared with.

No model is involved. Values are interpolated in the half vector's chart
(`fitting.scene.chart`), where lobes stand still, by local cubic radial basis functions
(Wendland 2005, Scattered Data Approximation, sec. 11) of ``asinh(f / s)``: logarithmic
above the noise floor ``s``, linear below it, so that zeros and negative values count for
what they are. How much is smoothed, the data decide: held-out rows are to be predicted
best. Reciprocity is used: exchanged directions are one point.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import RBFInterpolator, RegularGridInterpolator
from scipy.ndimage import distance_transform_edt
from scipy.spatial import KDTree

from data_formats import MeasurementError
from fitting.geometry import Geometry
from fitting.rows import Rows
from fitting.scene.chart import Chart, HalfAngles, from_half_angles, half_angles
from fitting.solid_angle import incidence_labels

_NEIGHBOURS = {True: 64, False: 96}
_SMOOTHINGS = (1e-2, 1.0, 1e1, 1e2, 1e3)
_FIRST_SMOOTHING = 1.0
_HELD_OUT, _FEWEST = 400, 12
_ABOVE_NOISE = 3.0
_NEARBY, _OVERSHOOT = 16, 0.25
_MAD_TO_SIGMA = 1.4826
_SCATTERED, _SCATTERED_RATIO = 40, 4.0
_FAR = 1.5
_BEYOND = math.radians(1.0)
_GRID = {True: (64, 31, 13), False: (25, 25, 13, 13)}


@dataclass(frozen=True)
class Reference:
    """Interpolated measurement of reflection at the front.

    Make one with `interpolate`. ``smoothing`` is the data's choice, ``relative_noise`` and
    ``floor`` (1/sr) the noise that the interpolation leaves over, per channel ``(c,)``.
    """

    chart: Chart
    smoothing: float
    relative_noise: np.ndarray
    floor: np.ndarray
    _table: RegularGridInterpolator
    _noise_table: RegularGridInterpolator
    _other_table: RegularGridInterpolator | None
    _scale: np.ndarray
    _tree: KDTree
    _far: float
    _steepest: np.ndarray

    def value(self, g: Geometry, *, noisy: bool = False) -> np.ndarray:
        """BRDF ``(n, c)``, 1/sr. ``noisy``: as another measurement of the same surface with
        the same noise would have it, to see what the noise does to an image."""
        at = _coordinates(half_angles(g), isotropic=self.chart.isotropic)
        v = self._table(at) + self._noise_table(at) if noisy else self._table(at)
        return self._scale * np.sinh(v)

    def otherwise(self, g: Geometry) -> np.ndarray:
        """`value` by a second interpolation, as plausible and a little worse: how far the
        two are apart is about how far the first is from the truth. Of anisotropic surfaces
        there is none, and it is the first."""
        at = _coordinates(half_angles(g), isotropic=self.chart.isotropic)
        return self._scale * np.sinh((self._other_table or self._table)(at))

    def supported(self, g: Geometry) -> np.ndarray:
        """``(n,)`` True where samples are near; elsewhere `value` is extrapolated."""
        angles = _steepness(g)
        distance, _ = self._tree.query(self.chart.points(half_angles(g)))
        return (distance <= self._far) & np.all(angles <= self._steepest + _BEYOND, axis=0)

    def nearest(self, g: Geometry) -> np.ndarray:
        """``(n,)`` the row that is nearest to each pair of directions."""
        return self._tree.query(self.chart.points(half_angles(g)))[1]


def interpolate(rows: Rows, *, isotropic: bool, seed: int = 0) -> Reference:
    """The reference of rows of light reflected at the front.

    Channels that miss values take the mean of the others there, relative to what is usual.
    Raises `MeasurementError` if there are less than twelve rows.
    """
    count = rows.index.size
    if count < _FEWEST:
        raise MeasurementError(
            f"found {count} rows of light reflected at the front; expected {_FEWEST} or "
            "more, to interpolate between"
        )
    angles = half_angles(rows.geometry)
    chart = _chart_of(rows, angles, isotropic)
    points = chart.points(angles)
    value = _complete(rows)
    rng = np.random.default_rng(seed)
    # A band that is mostly zero has the size of what it has.
    size = np.maximum(np.median(np.abs(value), axis=0), 1e-3 * np.abs(value).mean(axis=0))
    typical = np.where(size > 0, size, 1.0)
    scale = 0.3 * typical
    held = rng.permutation(len(points))[: min(_HELD_OUT, len(points) // 10)]
    kept = np.setdiff1d(np.arange(len(points)), held)
    neighbours = min(_NEIGHBOURS[isotropic], len(kept))

    def local(among: np.ndarray, columns: np.ndarray, smoothing: float) -> _Local:
        return _Local(points[among], columns[among], neighbours, smoothing)

    first = local(kept, np.arcsinh(value / scale), _FIRST_SMOOTHING)(points[held])
    relative, floor = _noise(value[held], scale * np.sinh(first))
    # Where noise bends neither way: a few times its size, or values are biased low.
    wanted = floor / np.clip(relative, 1e-3, 1.0 / _ABOVE_NOISE)
    scale = np.clip(wanted, 1e-2 * typical, np.maximum(typical, _ABOVE_NOISE * floor))
    columns = np.arcsinh(value / scale)
    # By the light that they carry: at grazing angles values rise beyond all smoothness.
    light = (rows.geometry.cos_i * rows.geometry.cos_o)[held, None]
    misses = [
        np.mean(light * np.abs(local(kept, columns, s)(points[held]) - columns[held]))
        for s in _SMOOTHINGS
    ]
    best = int(np.argmin(misses))
    residual = local(kept, columns, _SMOOTHINGS[best])(points[held]) - columns[held]
    spread = _MAD_TO_SIGMA * np.median(np.abs(residual), axis=0)
    noise = spread * rng.standard_normal(columns.shape)
    rbf = local(np.arange(len(points)), np.hstack([columns, noise]), _SMOOTHINGS[best])
    relative, floor = _noise(value[held], scale * np.sinh(columns[held] + residual))
    axes, table = _tabulated(rbf, chart)
    values, of_noise = (
        RegularGridInterpolator(axes, t, method="linear")
        for t in np.split(table, 2, axis=-1)
    )
    other = _round_table(chart, angles, columns, neighbours, _SMOOTHINGS[best])
    tree = KDTree(points)
    distance = tree.query(points, k=2)[0][:, 1]
    # Towards grazing values change fast, and nothing is known beyond the steepest rows.
    steepest = _steepness(rows.geometry).max(axis=1, keepdims=True)
    return Reference(
        chart=chart, smoothing=_SMOOTHINGS[best], relative_noise=relative, floor=floor,
        _table=values, _noise_table=of_noise, _other_table=other, _scale=scale, _tree=tree,
        _far=_FAR * max(1.0, float(np.percentile(distance, 95))), _steepest=steepest,
    )  # fmt: skip


def _steepness(g: Geometry) -> np.ndarray:
    """The larger and the smaller angle to the normal of both directions, ``(2, n)``."""
    cosines = np.stack([np.minimum(g.cos_i, g.cos_o), np.maximum(g.cos_i, g.cos_o)])
    return np.arccos(np.clip(cosines, -1.0, 1.0))


def _chart_of(rows: Rows, a: HalfAngles, isotropic: bool) -> Chart:
    """Steps of the sampling: half vectors of one incidence, and between incidences."""
    g = rows.geometry
    theta_i = np.arccos(np.clip(g.cos_i, -1.0, 1.0))
    label = incidence_labels(theta_i)
    count = int(label.max()) + 1
    centres = np.array([theta_i[label == k].mean() for k in range(count)])
    azimuths = 1 if isotropic else np.unique(np.round(np.arctan2(g.wiy, g.wix), 2)).size
    per_source = max(rows.index.size / (count * azimuths), 1.0)
    # Half vectors fill a quarter of the solid angle that the detectors fill.
    folded = isotropic and np.ptp(np.sign(np.sin(a.phi_d))) < 2
    step_h = 0.5 * math.sqrt((math.pi if folded else 2 * math.pi) / per_source)
    if count >= _SCATTERED:
        return Chart(step_h, _SCATTERED_RATIO * step_h, isotropic)
    gaps = np.diff(centres)
    step_d = float(np.median(gaps)) if gaps.size else math.radians(15.0)
    return Chart(step_h, max(step_d, step_h), isotropic)


def _complete(rows: Rows) -> np.ndarray:
    """Values ``(n, c)``, those that are missing from the channels that are there."""
    value, valid = np.where(rows.valid, rows.value, 0.0), rows.valid
    if valid.all():
        return value
    typical = np.sum(value, axis=0) / np.maximum(valid.sum(axis=0), 1)
    relative = np.sum(value, axis=1) / np.maximum(valid @ typical, 1e-300)
    return np.where(valid, value, relative[:, None] * typical)


def _noise(value: np.ndarray, smooth: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Relative noise of bright values and absolute noise of dark ones, per channel."""
    difference, size = np.abs(value - smooth), np.abs(smooth)
    order = np.argsort(size, axis=0)
    quarter = max(1, len(value) // 4)
    dark = np.take_along_axis(difference, order[:quarter], axis=0)
    ratio = difference / np.maximum(size, 1e-300)
    bright = np.take_along_axis(ratio, order[-quarter:], axis=0)
    spread = (_MAD_TO_SIGMA * np.median(a, axis=0) for a in (bright, dark))
    relative, floor = spread
    return relative, floor


class _Local:
    """Radial basis functions among the nearest points, cubic where these span the space.

    Where all near points are in a plane (a single incidence) nothing can be said of slopes
    across it, and linear ones serve, which ask for none. Points closer than a tenth of a
    step are one, with their mean.
    """

    def __init__(
        self, points: np.ndarray, columns: np.ndarray, neighbours: int, smoothing: float
    ):
        _, cell = np.unique(np.round(points, 1) + 0.0, axis=0, return_inverse=True)
        cell = cell.reshape(-1)
        where, mean = (_mean_of(a, cell) for a in (points, columns))
        near = min(neighbours, len(where))
        self._tree, self._mean = KDTree(where), mean
        self._linear = RBFInterpolator(
            where, mean, neighbors=near, smoothing=smoothing, kernel="linear", degree=0
        )
        self._cubic = None
        if len(where) > points.shape[1]:
            self._cubic = RBFInterpolator(
                where, mean, neighbors=near, smoothing=smoothing, kernel="cubic", degree=1
            )

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Values ``(n, c)``, which leave the range of those nearby by a quarter of it at
        most: beyond the data nothing grows without bounds."""
        count = min(_NEARBY, len(self._mean))
        index = self._tree.query(points, k=count)[1].reshape(len(points), count)
        near = self._mean[index]
        low, high = near.min(axis=1), near.max(axis=1)
        room = _OVERSHOOT * (high - low)
        return np.clip(self._between(points), low - room, high + room)

    def _between(self, points: np.ndarray) -> np.ndarray:
        if self._cubic is not None:
            try:
                return self._cubic(points)
            except np.linalg.LinAlgError:
                self._cubic = None
        return self._linear(points)


def _mean_of(a: np.ndarray, cell: np.ndarray) -> np.ndarray:
    """Mean of the rows of ``a (n, k)`` in each cell."""
    total = np.stack([np.bincount(cell, column) for column in a.T], axis=1)
    return total / np.bincount(cell)[:, None]


def _axes(isotropic: bool) -> list[np.ndarray]:
    """Nodes of the table; ``theta_h`` is ``(pi/2) t^2``, dense where lobes are."""
    size = _GRID[isotropic]
    t, theta_d = np.linspace(0, 1, size[0]), np.linspace(0, 0.5 * np.pi, size[-2])
    if isotropic:
        return [t, theta_d, np.linspace(0, 0.5 * np.pi, size[-1])]
    around = np.linspace(-np.pi, np.pi, size[1])
    return [t, around, theta_d, np.linspace(0, np.pi, size[-1])]


def _coordinates(a: HalfAngles, *, isotropic: bool) -> np.ndarray:
    t = np.sqrt(np.clip(a.theta_h / (0.5 * np.pi), 0.0, 1.0))
    theta_d = np.minimum(a.theta_d, 0.5 * np.pi)
    if isotropic:
        folded = np.arctan2(np.abs(np.sin(a.phi_d)), np.abs(np.cos(a.phi_d)))
        return np.stack([t, theta_d, folded], axis=-1)
    light = np.mod(a.phi_d + a.phi_h, np.pi)
    return np.stack([t, a.phi_h, theta_d, light], axis=-1)


def _round_table(
    chart: Chart,
    angles: HalfAngles,
    columns: np.ndarray,
    neighbours: int,
    smoothing: float,
) -> RegularGridInterpolator | None:
    """The interpolation in the chart whose azimuths are not squeezed."""
    if not chart.isotropic:
        return None
    other = replace(chart, squeeze=1.0)
    rbf = _Local(other.points(angles), columns, neighbours, smoothing)
    axes, table = _tabulated(rbf, other)
    return RegularGridInterpolator(axes, table, method="linear")


def _tabulated(rbf: _Local, chart: Chart) -> tuple[list[np.ndarray], np.ndarray]:
    """The interpolant on a grid, which is evaluated a thousand times faster."""
    axes = _axes(chart.isotropic)
    mesh = np.meshgrid(*axes, indexing="ij")
    shape = mesh[0].shape
    theta_h = 0.5 * np.pi * mesh[0] ** 2
    if chart.isotropic:
        angles = HalfAngles(theta_h, np.zeros(shape), mesh[1], mesh[2])
    else:
        angles = HalfAngles(theta_h, mesh[1], mesh[2], mesh[3] - mesh[1])
    g = from_half_angles(angles)
    # Beyond the horizon a cell keeps the value of the nearest one before it.
    seen = (g.cos_i > 1e-3) & (g.cos_o > 1e-3)
    flat = HalfAngles(
        *(getattr(angles, n)[seen] for n in ("theta_h", "phi_h", "theta_d", "phi_d"))
    )
    found = rbf(chart.points(flat))
    table = np.zeros((*shape, found.shape[1]))
    table[seen] = found
    nearest = distance_transform_edt(~seen, return_distances=False, return_indices=True)
    return axes, table[tuple(np.asarray(nearest))]
