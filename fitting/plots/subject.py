"""What a figure is about: a result, the data that it was fitted to, and which channels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from data_formats import Measurement, MeasurementError
from fitting.model import Model
from fitting.models import Way
from fitting.plots import NoFigure
from fitting.plots.style import channel_colours
from fitting.result import FitResult
from fitting.rows import select_rows, ways_of

# One size of array for all figures, so that the model is compiled once.
_CHUNK = 4096
_FEW = 3

WAY_NAMES: dict[Way, str] = {
    "front": "reflected",
    "back": "reflected at the back",
    "down": "transmitted",
    "up": "transmitted, lit from the back",
}


@dataclass(frozen=True)
class Subject:
    """A result and its data, with what several figures need of them.

    - `result`: of a fit.
    - `measurement`: what it was fitted to, or is compared with; None if not at hand.
    - `asked`: names of the channels to show; empty: some are picked.

    Raises `NoFigure` if the channels of both differ or a channel is not known.
    """

    result: FitResult
    measurement: Measurement | None = None
    asked: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        ours = [c.name for c in self.result.channels]
        if self.measurement is not None:
            theirs = [c.name for c in self.measurement.channels]
            if theirs != ours:
                raise NoFigure(
                    f"the result has the channels {_short(ours)} and the data have "
                    f"{_short(theirs)}; they must be the same"
                )
        for name in self.asked:
            if name not in ours:
                raise NoFigure(f"there is no channel {name!r}; known: {', '.join(ours)}")

    @cached_property
    def model(self) -> Model:
        return Model(self.result.model)

    @cached_property
    def names(self) -> list[str]:
        """Of all channels."""
        return [c.name for c in self.result.channels]

    @cached_property
    def wavelengths(self) -> np.ndarray | None:
        """``(c,)`` nm; None if a channel is a named band."""
        found = [c.wavelength_nm for c in self.result.channels]
        known = [w for w in found if w is not None]
        return np.array(known) if len(known) == len(found) else None

    @cached_property
    def chosen(self) -> list[int]:
        """The channels to show where there is no room for all: three, or as asked."""
        if self.asked:
            return [self.names.index(name) for name in self.asked]
        some = np.arange(len(self.names))
        if self.measurement is not None and self.measurement.valid.any():
            some = np.flatnonzero(self.measurement.valid.any(axis=0))
        if some.size <= _FEW:
            return some.tolist()
        at = self.wavelengths[some] if self.wavelengths is not None else some.astype(float)
        wanted = at.min() + np.array([1, 3, 5]) / 6.0 * np.ptp(at)
        nearest = np.abs(at - wanted[:, None]).argmin(axis=1)
        return some[np.unique(nearest)].tolist()

    @cached_property
    def channel(self) -> int:
        """The one channel to show where there is room for one only."""
        return self.chosen[len(self.chosen) // 2]

    @cached_property
    def colours(self) -> dict[int, str]:
        """Of the chosen channels."""
        own = [self.result.channels[c] for c in self.chosen]
        colours = channel_colours([c.name for c in own], [c.wavelength_nm for c in own])
        return dict(zip(self.chosen, colours, strict=True))

    @property
    def data(self) -> Measurement:
        """The data; raises `NoFigure` if there are none at hand."""
        if self.measurement is None:
            raise NoFigure("it needs the measurement")
        return self.measurement

    @cached_property
    def ways(self) -> tuple[Way, ...]:
        """The ways of light that the model knows and that were measured, if that is known.

        Raises `NoFigure` if there is none.
        """
        if self.measurement is None:
            return self.model.ways
        seen: set[Any] = set(ways_of(self.measurement).tolist())
        both: tuple[Way, ...] = tuple(w for w in self.model.ways if w in seen)
        if not both:
            raise NoFigure(
                f"{self.result.model!r} has no lobe for the light that was measured"
            )
        return both

    @cached_property
    def way(self) -> np.ndarray:
        """``(n,)`` the way of light of every row of the data."""
        return ways_of(self.data)

    @cached_property
    def used(self) -> np.ndarray:
        """``(n,)`` whether a fit with the settings of the result uses a row."""
        out = np.zeros(self.data.n_rows, dtype=bool)
        limit = self.result.settings.max_theta_deg
        try:
            out[select_rows(self.data, limit, self.model.ways).index] = True
        except MeasurementError:
            return out
        return out

    @cached_property
    def fitted(self) -> np.ndarray:
        """``(n, c)`` the model at every row of the data, 1/sr."""
        m = self.data
        return self.evaluate(m.theta_i, m.phi_i, m.theta_r, m.phi_r)

    @property
    def quantity(self) -> str:
        """What the values are."""
        through = {"down", "up"} & set(self.ways)
        return "BSDF" if through else "BRDF"

    @property
    def source(self) -> str:
        """The name of the fitted file, or of the first of several, and that of the data."""
        data = self.result.data
        name = _file_name(data.path) or data.sample or "data without a file"
        if self.measurement is None:
            return name
        theirs = self.measurement.provenance
        if theirs.sha256 == data.sha256 or not theirs.path:
            return name
        return f"{name}, compared with {_file_name(theirs.path)}"

    def evaluate(
        self, theta_i: ArrayLike, phi_i: ArrayLike, theta_r: ArrayLike, phi_r: ArrayLike
    ) -> np.ndarray:
        """The model ``(..., c)``, 1/sr, at angles in radians of shapes that go together."""
        angles = np.broadcast_arrays(
            *(np.asarray(a, dtype=np.float64) for a in (theta_i, phi_i, theta_r, phi_r))
        )
        shape, count = angles[0].shape, angles[0].size
        out = np.empty((count, len(self.names)))
        flat = [a.reshape(-1) for a in angles]
        for start in range(0, count, _CHUNK):
            part = [a[start : start + _CHUNK] for a in flat]
            n = part[0].size
            full = [np.concatenate([a, np.repeat(a[:1], _CHUNK - n)]) for a in part]
            value = self.result.evaluate(*full)[:n].reshape(n, -1)
            out[start : start + n] = value
        return out.reshape((*shape, len(self.names)))


def _file_name(path: str) -> str:
    """Without folders; of several files the first, and how many more."""
    names = [Path(p).name for p in path.split(" + ")]
    return names[0] + (f" and {len(names) - 1} more" if len(names) > 1 else "")


def _short(names: Sequence[str]) -> str:
    if len(names) <= 4:
        return ", ".join(names)
    return f"{names[0]} ... {names[-1]} ({len(names)})"
