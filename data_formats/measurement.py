"""`Measurement`: directions, BSDF values and what is known about them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from data_formats.provenance import Note, Provenance

Symmetry = Literal["isotropic", "bilateral", "anisotropic"]

# The auxiliary column with the part of the hemisphere that a row stands for, sr, weighed by
# the cosine, where the file states it.
PROJECTED_SOLID_ANGLE = "projected_solid_angle"

# rad; what conversion from degrees leaves of a direction on the horizon.
_ON_HORIZON = 1e-9


class MeasurementError(ValueError):
    """A file or a measurement that cannot be used, said in one sentence."""


@dataclass(frozen=True)
class Channel:
    """One spectral channel: a wavelength, or a named band.

    **Arguments:**

    - `name`: what people call it, such as `"400 nm"` or `"R"`.
    - `wavelength_nm`: the wavelength in nm; `None` for a named band.
    """

    name: str
    wavelength_nm: float | None = None

    def __post_init__(self) -> None:
        if not self.name.strip() or not self.name.isprintable():
            raise MeasurementError(
                f"the channel name {self.name!r} must be printable and not blank"
            )
        wavelength = self.wavelength_nm
        if wavelength is not None and not (0 < wavelength < np.inf):
            raise MeasurementError(
                f"channel {self.name!r} has the wavelength {wavelength} nm; "
                "it must be positive and finite"
            )

    @staticmethod
    def at(wavelength_nm: float) -> Channel:
        """The channel at a wavelength in nm, named after it."""
        return Channel(f"{wavelength_nm:.12g} nm", float(wavelength_nm))


@dataclass(frozen=True, eq=False)
class Measurement:
    """A measured BSDF: `n` pairs of directions by `c` spectral channels.

    The surface normal is z; `theta_i, phi_i` point to the source and `theta_r, phi_r` to
    the detector. `theta_i > pi/2` is a sample lit from the back; `theta_r` on the other
    side of the horizon than `theta_i` is transmitted light. Specular reflection is
    `phi_r - phi_i = pi`. Arrays are copied, float64 (`valid`: bool) and read-only.

    **Arguments:**

    - `theta_i`, `phi_i`, `theta_r`, `phi_r`: (n,) rad; theta in [0, pi].
    - `value`: (n, c) BSDF in 1/sr, without cosine; negatives as measured. Finite where
        `valid`.
    - `valid`: (n, c) False: not measured, extrapolated by the instrument, not finite.
    - `channels`: c channels, with distinct names and wavelengths.
    - `sigma`: (n, c) standard uncertainty (k = 1) in 1/sr, positive where `valid`.
    - `symmetry`: `"isotropic"`: depends on `phi_r - phi_i` only; `"bilateral"`: isotropic,
        and mirror symmetry is assumed since only one side of the plane of incidence was
        measured; `"anisotropic"`: depends on both azimuths.
    - `provenance`: the file, the instrument, the sample.
    - `notes`: everything that the reader has to say.
    - `auxiliary`: further named columns of the file, (n,) each, in the file's units;
        `PROJECTED_SOLID_ANGLE` is known by name.

    **Raises:** `MeasurementError` if an array does not fit this description.
    """

    theta_i: NDArray[np.float64]
    phi_i: NDArray[np.float64]
    theta_r: NDArray[np.float64]
    phi_r: NDArray[np.float64]
    value: NDArray[np.float64]
    valid: NDArray[np.bool_]
    channels: tuple[Channel, ...]
    sigma: NDArray[np.float64] | None = None
    symmetry: Symmetry = "isotropic"
    provenance: Provenance = field(default_factory=Provenance)
    notes: tuple[Note, ...] = ()
    auxiliary: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._set("channels", tuple(self.channels))
        self._set("notes", tuple(self.notes))
        if self.symmetry not in get_args(Symmetry):
            known = ", ".join(get_args(Symmetry))
            raise MeasurementError(
                f"symmetry is {self.symmetry!r}; expected one of {known}"
            )
        _check_channels(self.channels)

        self._set("theta_i", _frozen("theta_i", self.theta_i, None))
        rows, table = (self.n_rows,), (self.n_rows, self.n_channels)
        for name in ("theta_i", "phi_i", "theta_r", "phi_r"):
            self._set(name, _frozen(name, getattr(self, name), rows))
            _check_angle(name, getattr(self, name))
        self._set("value", _frozen("value", self.value, table))
        self._set("valid", _frozen("valid", self.valid, table, np.bool_))
        wrong = int(np.count_nonzero(self.valid & ~np.isfinite(self.value)))
        if wrong:
            raise MeasurementError(
                f"value is not finite in {wrong} entries marked as valid"
            )
        # Masked entries are a number or NaN: one way to say "unknown".
        self._set("value", _frozen("value", _finite_or_nan(self.value), table))
        if self.sigma is not None:
            self._set("sigma", _frozen("sigma", self.sigma, table))
            usable = (self.sigma > 0) & np.isfinite(self.sigma)
            wrong = int(np.count_nonzero(self.valid & ~usable))
            if wrong:
                raise MeasurementError(
                    f"sigma is not a positive number in {wrong} valid entries"
                )
        columns = {k: _frozen(k, v, rows) for k, v in self.auxiliary.items()}
        if unnamed := [k for k in columns if not k.strip() or not k.isprintable()]:
            raise MeasurementError(
                f"the auxiliary column name {unnamed[0]!r} must be printable and not blank"
            )
        self._set("auxiliary", columns)

    def _set(self, name: str, content: Any) -> None:
        object.__setattr__(self, name, content)

    @property
    def n_rows(self) -> int:
        """Number of pairs of directions."""
        return len(self.theta_i)

    @property
    def n_channels(self) -> int:
        """Number of spectral channels."""
        return len(self.channels)

    @property
    def wavelengths(self) -> NDArray[np.float64] | None:
        """(c,) wavelengths in nm; `None` if any channel is a named band."""
        found = [c.wavelength_nm for c in self.channels if c.wavelength_nm is not None]
        return np.array(found) if len(found) == self.n_channels else None

    @property
    def transmitted(self) -> NDArray[np.bool_]:
        """(n,) whether source and detector are on different sides of the surface.

        A direction within 1e-9 rad of the horizon counts as on the other one's side.
        """
        return _side(self.theta_i) * _side(self.theta_r) < 0

    @property
    def from_back(self) -> NDArray[np.bool_]:
        """(n,) whether the sample is lit from the back, `theta_i > pi/2 + 1e-9`."""
        return _side(self.theta_i) < 0

    def select(self, rows: ArrayLike) -> Measurement:
        """The measurement at some rows only: a boolean mask (n,), or indices."""
        rows = np.asarray(rows)
        if rows.size == 0:
            rows = rows.astype(np.intp)
        return replace(
            self,
            theta_i=self.theta_i[rows],
            phi_i=self.phi_i[rows],
            theta_r=self.theta_r[rows],
            phi_r=self.phi_r[rows],
            value=self.value[rows],
            valid=self.valid[rows],
            sigma=None if self.sigma is None else self.sigma[rows],
            auxiliary={k: v[rows] for k, v in self.auxiliary.items()},
        )

    def equals(self, other: Measurement) -> bool:
        """Whether two measurements say exactly the same, bit for bit, NaN equal to NaN.

        Compared are directions, values, masks, uncertainties, channels, symmetry and
        auxiliary columns; not `provenance` and `notes`, which tell the way here.
        """
        if (self.sigma is None) != (other.sigma is None):
            return False
        if (self.channels, self.symmetry) != (other.channels, other.symmetry):
            return False
        if self.auxiliary.keys() != other.auxiliary.keys():
            return False
        return all(
            a.shape == b.shape and np.array_equal(a, b, equal_nan=a.dtype != np.bool_)
            for a, b in zip(self._arrays(), other._arrays(), strict=True)
        )

    def _arrays(self) -> list[NDArray[Any]]:
        """All arrays, in an order that does not depend on that of `auxiliary`."""
        arrays = [
            self.theta_i,
            self.phi_i,
            self.theta_r,
            self.phi_r,
            self.value,
            self.valid,
        ]
        arrays += [] if self.sigma is None else [self.sigma]
        return arrays + [self.auxiliary[name] for name in sorted(self.auxiliary)]


def _frozen(
    name: str,
    array: ArrayLike,
    shape: tuple[int, ...] | None,
    dtype: type[np.float64] | type[np.bool_] = np.float64,
) -> NDArray[Any]:
    """A read-only C-ordered copy; `shape=None` asks for any one-dimensional array."""
    try:
        copy = np.array(array, dtype=dtype, order="C")
    except (TypeError, ValueError) as error:
        raise MeasurementError(f"{name} is not an array of numbers: {error}") from error
    if copy.ndim != 1 if shape is None else copy.shape != shape:
        expected = "(n,)" if shape is None else str(shape)
        raise MeasurementError(f"{name} has the shape {copy.shape}; expected {expected}")
    copy.setflags(write=False)
    return copy


def _side(theta: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n,) 1 in front, -1 behind, 0 on the horizon."""
    beyond = theta - np.pi / 2
    return np.where(np.abs(beyond) <= _ON_HORIZON, 0.0, -np.sign(beyond))


def _finite_or_nan(array: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.where(np.isfinite(array), array, np.nan)


def _check_channels(channels: tuple[Channel, ...]) -> None:
    if not channels:
        raise MeasurementError("there is no channel; expected at least one")
    _check_distinct("name", [c.name for c in channels])
    _check_distinct(
        "wavelength", [c.wavelength_nm for c in channels if c.wavelength_nm is not None]
    )


def _check_distinct(what: str, found: Sequence[object]) -> None:
    if len(set(found)) < len(found):
        twice = next(x for x in found if found.count(x) > 1)
        raise MeasurementError(f"two channels have the {what} {twice}")


def _check_angle(name: str, angle: NDArray[np.float64]) -> None:
    wrong = ~np.isfinite(angle)
    expected = "a finite number of radians"
    if name.startswith("theta"):
        wrong |= ~((angle >= 0) & (angle <= np.pi))
        expected = "0 to pi radians"
    if wrong.any():
        row = int(np.argmax(wrong))
        raise MeasurementError(
            f"{name} is {angle[row]} in row {row}, and {int(wrong.sum())} rows in all are "
            f"out of range; expected {expected}"
        )
