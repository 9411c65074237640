"""What is integrated: a model with its parameters, and how uncertain they are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import ArrayLike

from fitting.expression import ModelError
from fitting.model import Model
from fitting.models import Lobe
from fitting.parameters import Parameter
from fitting.result import FitResult


@dataclass(frozen=True)
class Covariance:
    """Of the parameters of all channels, from what a fit tells of each.

    ``names`` are the free parameters, the first ``shared`` of them with one value for all
    channels; ``matrices (c, k, k)`` their covariance per channel, 0 where there is none.
    ``follow (c, k)`` tells by how much each parameter of the model moves with them, and
    ``without`` which free ones have no uncertainty in some channel.
    """

    names: tuple[str, ...]
    shared: int
    matrices: np.ndarray
    follow: Mapping[str, np.ndarray]
    without: tuple[str, ...]

    def of_channels(self, slopes: Mapping[str, np.ndarray]) -> np.ndarray:
        """Covariance ``(c, c)`` of one number per channel, from its slopes ``(c,)``.

        With the shared parameters u, those of a channel x and ``B = S_xu S_uu^-1``, the
        fit's ``x_c`` are independent given u: ``cov(y_c, y_c') = e_c S_uu e_c'^T`` with
        ``e_c = dy/du + dy/dx B_c``, and a channel adds ``dy/dx (S_xx - B S_ux) dy/dx^T``
        to its own variance.
        """
        k = self.shared
        moved = [slopes[n][:, None] * f for n, f in self.follow.items()]
        slope = np.sum(moved, axis=0)
        u, x = slope[:, :k], slope[:, k:]
        s_uu, s_xu, s_xx = (
            self.matrices[:, :k, :k], self.matrices[:, k:, :k], self.matrices[:, k:, k:]
        )  # fmt: skip
        b = s_xu @ np.linalg.pinv(s_uu, hermitian=True)
        rest = s_xx - b @ np.swapaxes(s_xu, 1, 2)
        own = np.maximum(np.einsum("ci,cij,cj->c", x, rest, x), 0.0)
        along = u + np.einsum("ci,cij->cj", x, b)
        joint = along @ s_uu[0] @ along.T if k else np.zeros((len(own), len(own)))
        return joint + np.diag(own)


@dataclass(frozen=True)
class Surface:
    """A model with values of its parameters.

    - `model`: the sum of lobes.
    - `values`: all parameters by full name; scalars, or one per channel.
    - `names`: of the channels.
    - `wavelengths_nm`: of the channels, None for named bands.
    - `covariance`: None if the values are taken as exact.

    Raises `ModelError` for parameters missing or unknown, or of different lengths.
    """

    model: Model
    values: Mapping[str, np.ndarray]
    names: tuple[str, ...]
    wavelengths_nm: tuple[float | None, ...]
    covariance: Covariance | None = None

    @property
    def channels(self) -> int:
        return len(self.names)

    def lobe_shape(self, index: int) -> dict[str, Any]:
        """Shape parameters of a lobe under their short names."""
        own = self.model.of_lobe(index, self.values)
        return {p.name: own[p.name] for p in self._declared(index) if not p.coefficient}

    def amplitudes(self, index: int) -> np.ndarray:
        """``(J, c)``: what multiplies each basis function of a lobe."""
        with jax.enable_x64(True):
            values = {
                n: jnp.broadcast_to(jnp.asarray(v, jnp.float64), (self.channels,))
                for n, v in self.model.of_lobe(index, self.values).items()
            }
            return np.asarray(lobe_amplitudes(self.model.lobes[index], values))

    def _declared(self, index: int) -> tuple[Parameter, ...]:
        return self.model.lobes[index].parameters()


def surface_of(
    expression: str,
    values: Mapping[str, ArrayLike],
    *,
    wavelengths_nm: Sequence[float] | None = None,
) -> Surface:
    """A surface from a model expression and its parameters, which are taken as exact."""
    model = Model(expression)
    known, own = model.parameters(), {n: np.asarray(v, float) for n, v in values.items()}
    missing, unknown = (
        [n for n in known if n not in own],
        [n for n in own if n not in known],
    )
    if missing or unknown:
        raise ModelError(
            f"model {expression!r}: parameters missing {missing}, unknown {unknown}; it "
            f"has {list(known)}"
        )
    sizes = {v.size for v in own.values() if v.ndim}
    if len(sizes) > 1 or any(v.ndim > 1 for v in own.values()):
        raise ModelError(
            f"model {expression!r}: parameters have {sorted(sizes)} values; expected one, "
            "or the same number for each"
        )
    count = sizes.pop() if sizes else 1
    if wavelengths_nm is None:
        names = tuple(str(k + 1) for k in range(count)) if count > 1 else ("all",)
        return Surface(model, own, names, (None,) * count)
    if len(wavelengths_nm) != count and sizes:
        raise ModelError(
            f"found {len(wavelengths_nm)} wavelengths; expected {count}, as many as values"
        )
    at = tuple(float(w) for w in wavelengths_nm)
    return Surface(model, own, tuple(f"{w:g} nm" for w in at), at)


def surface_of_result(result: FitResult) -> Surface:
    """The fitted surface, with the uncertainties that the fit states."""
    return Surface(
        Model(result.model),
        result.values,
        tuple(c.name for c in result.channels),
        tuple(c.wavelength_nm for c in result.channels),
        covariance_of(result),
    )


def covariance_of(result: FitResult) -> Covariance | None:
    """From standard uncertainties and correlations; None if there are none at all."""
    c, names = len(result.channels), tuple(result.correlations.names)
    tables = {p.name: p for p in result.parameters}
    sd = np.zeros((c, len(names)))
    without = []
    for j, name in enumerate(names):
        found = tables[name].standard_uncertainty
        sd[:, j] = [0.0 if s is None else s for s in found]
        if any(s is None for s in found):
            without.append(name)
    if not sd.any():
        return None
    correlation = np.array(result.correlations.matrices, dtype=float)
    correlation = np.where(np.isfinite(correlation), correlation, 0.0)
    correlation = np.broadcast_to(correlation, (c, *correlation.shape[1:])).copy()
    correlation[:, np.arange(len(names)), np.arange(len(names))] = 1.0
    follow = {}
    for p in result.parameters:
        lead = p.tied_to or p.name
        row = np.zeros((c, len(names)))
        if not p.fixed and lead in names:
            own, other = np.array(p.value), np.array(tables[lead].value)
            safe = np.where(other == 0, 1.0, other)
            row[:, names.index(lead)] = np.where(other == 0, 1.0, own / safe)
        follow[p.name] = row
    shared = sum(tables[n].kind == "shape" and len(tables[n].value) == 1 for n in names)
    matrices = correlation * sd[:, :, None] * sd[:, None, :]
    return Covariance(names, shared, matrices, follow, tuple(without))


def lobe_amplitudes(lobe: Lobe, values: Mapping[str, jax.Array]) -> jax.Array:
    declared = lobe.parameters()
    shape = {p.name: values[p.name] for p in declared if not p.coefficient}
    linear = tuple(values[p.name] for p in declared if p.coefficient)

    def one(s: dict, x: tuple) -> jax.Array:
        return jnp.stack([jnp.asarray(a) for a in lobe.amplitudes(s, x)])

    return jax.vmap(one, out_axes=1)(shape, linear)


def amplitude_slopes(surface: Surface, index: int) -> dict[str, np.ndarray]:
    """``d amplitude (J, c)`` by each parameter of a lobe, of the same channel."""
    lobe = surface.model.lobes[index]
    own = surface.model.of_lobe(index, surface.values)
    with jax.enable_x64(True):
        values = {
            n: jnp.broadcast_to(jnp.asarray(v, jnp.float64), (surface.channels,))
            for n, v in own.items()
        }
        zero = {n: jnp.zeros_like(v) for n, v in values.items()}
        return {
            n: np.asarray(
                jax.jvp(
                    lambda v: lobe_amplitudes(lobe, v),
                    (values,),
                    (zero | {n: jnp.ones_like(zero[n])},),
                )[1]
            )
            for n in values
        }
