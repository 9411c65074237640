"""The lobes of a surface, each with its values in the channels of a target."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from fitting import expression as expr
from fitting.export import conductor_curve
from fitting.export.conductor_curve import Values
from fitting.export.surface import Surface
from fitting.geometry import Geometry
from fitting.model import Model
from fitting.models import Lobe, lobe_names
from fitting.models.beckmann import Beckmann
from fitting.models.ggx import GGX
from fitting.predict import predict_geometry


@dataclass(frozen=True)
class Part:
    """One lobe: as written, as an object, and its values under their short names.

    Coefficients have shape ``(c,)``; shape parameters ``()``, or ``(c,)`` where every
    channel has its own. ``curve (n, c)`` is the Fresnel term of facets whose index differs
    over the wavelengths that were mixed, at `conductor_curve.nodes`: a mixture of curves,
    which is no curve of one index; None for others.
    """

    term: expr.Term
    lobe: Lobe
    values: Values
    curve: np.ndarray | None = None

    def named(self, name: str) -> bool:
        """Whether the lobe is of that name, turned neither around nor over."""
        options = set(self.term.options)
        return self.term.lobe == name and not options & {"retro", "back"}

    def has(self, option: str) -> bool:
        """Whether an option is written."""
        return option in self.term.options


@dataclass(frozen=True)
class Lobes:
    """A sum of lobes of this program, as what a target computes from its file."""

    expression: str
    values: Values
    words: str

    def __call__(self, geometry: Geometry) -> np.ndarray:
        f = predict_geometry(Model(self.expression), self.values, geometry)
        return f.reshape(f.shape[0], -1)


def sum_of(terms: Sequence[tuple[str, Values]], words: str = "") -> Lobes:
    """The sum of lobes, each written as in an expression and with its values."""
    expression = " + ".join(term for term, _ in terms)
    model = Model(expression)
    values = {
        f"{label}.{name}": np.asarray(value)
        for label, (_, own) in zip(model.labels, terms, strict=True)
        for name, value in own.items()
    }
    return Lobes(model.expression, values, words or f"{model.expression}")


def parts_of(surface: Surface) -> tuple[list[Part], list[str]]:
    """The lobes of a surface in the target's channels, and where that is not exact.

    Where the target's channels are some of the fit's, values are theirs. Where they are
    mixtures (spectra reduced to colours), the mixture of a lobe is a lobe of the same kind
    if it is linear in its coefficients and has one shape for all channels; an amplitude of
    a single coefficient is inverted. Else coefficients and shapes are mixed themselves, an
    approximation that is said.
    """
    model, result = surface.model, surface.result
    terms = expr.parse(model.expression, lobe_names())
    remarks: list[str] = []
    out: list[Part] = []
    channels = len(result.channels)
    for i, (term, lobe) in enumerate(zip(terms, model.lobes, strict=True)):
        own = {n: np.asarray(v) for n, v in model.of_lobe(i, result.values).items()}
        declared = {p.name: p for p in lobe.parameters()}
        wide = {
            n: np.broadcast_to(v, (channels,)) if declared[n].coefficient or v.ndim else v
            for n, v in own.items()
        }
        picks = surface.mixing.selects
        if picks is not None:
            out.append(
                Part(term, lobe, {n: v[picks] if v.ndim else v for n, v in wide.items()})
            )
            continue
        values, exact = _mixed(lobe, wide, surface.mixing.matrix)
        values, clipped = _within_support(lobe, values)
        curve = None if exact else _mixed_curve(lobe, wide, surface.mixing.matrix)
        out.append(Part(term, lobe, values, curve))
        if curve is not None:
            continue
        remarks += [f"{model.labels[i]}.{text}" for text in clipped]
        if not exact:
            remarks.append(
                f"{model.labels[i]} does not mix linearly over wavelengths: its parameters "
                "were mixed like colours, which the distance from the fit includes"
            )
    return out, remarks


def parts_of_lobes(lobes: Lobes) -> list[Part]:
    """The lobes of a sum whose values are in the target's channels already."""
    model = Model(lobes.expression)
    terms = expr.parse(lobes.expression, lobe_names())
    return [
        Part(
            term,
            lobe,
            {n: np.asarray(v) for n, v in model.of_lobe(i, lobes.values).items()},
        )
        for i, (term, lobe) in enumerate(zip(terms, model.lobes, strict=True))
    ]


def _within_support(lobe: Lobe, values: Values) -> tuple[Values, list[str]]:
    """Coefficients that a colour outside of the gamut carries below 0 or above 1, at the
    end of their support."""
    out, said = dict(values), []
    for p in lobe.parameters():
        if not p.coefficient:
            continue
        out[p.name] = np.clip(values[p.name], *p.support)
        off = float(np.max(np.abs(out[p.name] - values[p.name])))
        if off > 1e-9:
            said.append(
                f"{p.name} is a colour outside of the gamut of sRGB; it was moved by "
                f"{off:.2g} to its edge"
            )
    return out, said


def _mixed_curve(lobe: Lobe, values: Values, matrix: np.ndarray) -> np.ndarray | None:
    """The mixture of Fresnel curves; None where not they alone differ, but widths as well.

    Colours outside of the gamut are at its edge.
    """
    if not isinstance(lobe, GGX | Beckmann):
        return None
    own = {"eta", "k", "power"}
    varying = {p.name for p in lobe.parameters() if not p.coefficient}
    varying = {n for n in varying if values[n].ndim and np.ptp(values[n]) > 0}
    if not varying or varying - own:
        return None
    curves = conductor_curve.reflectance(lobe, values, conductor_curve.nodes())
    return np.maximum(curves @ matrix, 0.0)


def _mixed(lobe: Lobe, values: Values, matrix: np.ndarray) -> tuple[Values, bool]:
    declared = {p.name: p for p in lobe.parameters()}
    names = [n for n in values if declared[n].coefficient]
    shapes = {n: v for n, v in values.items() if n not in names}
    shared = all(v.ndim == 0 or np.ptp(v) == 0 for v in shapes.values())
    # Brightness decides on a shape that all colours share.
    share = np.maximum(matrix.sum(axis=1), 0.0)
    share = share / share.sum()
    mixed = {
        n: np.asarray(v if v.ndim == 0 else v[0] if np.ptp(v) == 0 else v @ share)
        for n, v in shapes.items()
    }
    straight = {n: values[n] @ matrix for n in names}
    if lobe.linear and shared:
        return {**mixed, **straight}, True
    if len(names) == 1 and shared:
        inverse = _inverted(lobe, mixed, values[names[0]], matrix, straight[names[0]])
        if inverse is not None:
            return {**mixed, names[0]: inverse}, True
    return {**mixed, **straight}, False


def _inverted(
    lobe: Lobe,
    shape: Values,
    coefficient: np.ndarray,
    matrix: np.ndarray,
    first: np.ndarray,
) -> np.ndarray | None:
    """The coefficient whose one amplitude is the mixture; None with several amplitudes."""
    with jax.enable_x64(True):
        own = {n: jnp.asarray(v) for n, v in shape.items()}

        def amplitude(x: np.ndarray) -> np.ndarray | None:
            found = lobe.amplitudes(own, (jnp.asarray(x),))
            return np.asarray(found[0]) if len(found) == 1 else None

        each = amplitude(coefficient)
        if each is None:
            return None
        wanted = each @ matrix
        low, high = np.full_like(first, -2.0), np.full_like(first, 2.0)
        for _ in range(60):
            middle = 0.5 * (low + high)
            below = amplitude(middle)
            assert below is not None
            low = np.where(below < wanted, middle, low)
            high = np.where(below < wanted, high, middle)
        return 0.5 * (low + high)
