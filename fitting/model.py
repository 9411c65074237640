"""A model: a sum of lobes as one function of parameters and geometry."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from typing import Any, get_args

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike

from fitting import expression as expr
from fitting.geometry import Geometry, from_angles
from fitting.models import Lobe, lobe_class, lobe_names
from fitting.models.lobe import THROUGH, Way
from fitting.models.retro import Retro
from fitting.models.turned_over import TurnedOver
from fitting.parameters import Parameter

Parameters = Mapping[str, ArrayLike]


class Model(eqx.Module):
    """A sum of lobes, ``Model("lambert + ggx")``; a pure function under JAX.

    ``model(parameters, geometry)`` is the BRDF, 1/sr without cosine, of shape ``(n, c)``
    for coefficients of shape ``(c,)`` and ``(n,)`` if they are all scalars; shape
    parameters are scalars, or ``(c,)`` to give every channel its own. ``parameters`` maps
    names such as ``"ggx.alpha"`` to values; see `parameters` for the names. Works under
    ``jit``, ``vmap`` and ``grad``. Raises `ModelError` for a senseless expression.
    """

    lobes: tuple[Lobe, ...]
    labels: tuple[str, ...] = eqx.field(static=True)
    expression: str = eqx.field(static=True)

    def __init__(self, expression: str):
        terms = expr.parse(expression, lobe_names())
        self.lobes = tuple(_make_lobe(t) for t in terms)
        own = zip(terms, self.lobes, strict=True)
        self.labels = expr.lobe_labels(
            tuple(lobe.NAME if t.lobe.endswith(".py") else t.lobe for t, lobe in own)
        )
        self.expression = expr.canonical(terms)

    def parameters(self) -> dict[str, Parameter]:
        """All parameters by full name, in the order of the lobes."""
        return {
            f"{label}.{p.name}": p
            for label, lobe in zip(self.labels, self.lobes, strict=True)
            for p in lobe.parameters()
        }

    def defaults(self) -> dict[str, float]:
        """Default value of every parameter."""
        return {name: p.default for name, p in self.parameters().items()}

    @property
    def anisotropic(self) -> bool:
        """Whether a lobe depends on the azimuth of the sample itself."""
        return any(p.scale == "periodic" for p in self.parameters().values())

    @property
    def ways(self) -> tuple[Way, ...]:
        """The ways of light that one of the lobes knows."""
        known = {w for lobe in self.lobes for w in lobe.ways}
        return tuple(w for w in get_args(Way) if w in known)

    @property
    def reciprocal(self) -> bool:
        """Whether whatever the parameters are: reciprocal lobes between the same media."""
        through = [o for o in self.lobes if set(o.ways) & set(THROUGH)]
        media = [o for o in through if _between_media(o)]
        alike = len(media) == 0 or len(through) == 1
        return alike and all(lobe.RECIPROCAL for lobe in self.lobes)

    def relative_index(self, shape: Mapping[str, Any]) -> Array | float:
        """Index of the medium behind the sample relative to the one in front.

        Of the first lobe that lies between different media; 1 without one.
        """
        for i, lobe in enumerate(self.lobes):
            if _between_media(lobe):
                return lobe.relative_index(self.of_lobe(i, shape))
        return 1.0

    def n_basis(self, index: int) -> int:
        """Number of basis functions of one lobe."""
        return _n_basis(self.lobes[index])

    def of_lobe(self, index: int, values: Mapping[str, Any]) -> dict[str, Any]:
        """The values of one lobe under their short names."""
        label = self.labels[index]
        return {
            p.name: values[f"{label}.{p.name}"]
            for p in self.lobes[index].parameters()
            if f"{label}.{p.name}" in values
        }

    def basis(self, shape: Mapping[str, Array], geometry: Geometry) -> tuple[Array, ...]:
        """Basis functions of all lobes in order, each ``(n,)``, 1/sr."""
        return tuple(
            b
            for i, lobe in enumerate(self.lobes)
            for b in lobe.basis(self.of_lobe(i, shape), geometry)
        )

    def amplitudes(
        self, shape: Mapping[str, Array], coefficients: Mapping[str, Array]
    ) -> tuple[Array, ...]:
        """The factor of each basis function, from the coefficients."""
        out: list[Array] = []
        for i, lobe in enumerate(self.lobes):
            own = self.of_lobe(i, coefficients)
            ordered = tuple(own[p.name] for p in lobe.parameters() if p.coefficient)
            out += lobe.amplitudes(self.of_lobe(i, shape), ordered)
        return tuple(out)

    def __call__(self, parameters: Parameters, geometry: Geometry) -> Array:
        known = self.parameters()
        missing = [n for n in known if n not in parameters]
        unknown = [n for n in parameters if n not in known]
        if missing or unknown:
            raise expr.ModelError(
                f"model {self.expression!r}: parameters missing {missing}, "
                f"unknown {unknown}; it has {list(known)}"
            )
        values = {n: jnp.asarray(v) for n, v in parameters.items()}
        if any(v.ndim and not known[n].coefficient for n, v in values.items()):
            return _per_channel(self, values, geometry)
        shape = {n: v for n, v in values.items() if not known[n].coefficient}
        linear = {n: v for n, v in values.items() if known[n].coefficient}
        terms = [
            b[..., None] * a if jnp.ndim(a) else b * a
            for b, a in zip(
                self.basis(shape, geometry),
                self.amplitudes(shape, linear),
                strict=True,
            )
        ]
        wide = max(t.ndim for t in terms)
        terms = [t[..., None] if t.ndim < wide else t for t in terms]
        return sum(terms[1:], terms[0])


def _per_channel(model: Model, values: dict[str, Array], geometry: Geometry) -> Array:
    channels = max(v.shape[0] for v in values.values() if v.ndim)
    wide = {n: jnp.broadcast_to(v, (channels,)) for n, v in values.items()}
    return jax.vmap(lambda one: model(one, geometry), out_axes=-1)(wide)


def _between_media(lobe: Lobe) -> bool:
    """Whether the lobe lets light into a medium of another index."""
    shape = {p.name: p.default for p in lobe.parameters() if not p.coefficient}
    return bool(lobe.relative_index(shape) != 1.0)  # pyright: ignore[reportArgumentType]


def _make_lobe(term: expr.Term) -> Lobe:
    cls = lobe_class(term.lobe)
    known = expr.options_of(cls)
    for option in term.options:
        if option not in known:
            has = f"; it has {', '.join(known)}" if known else ", nor any other"
            raise expr.ModelError(f"lobe {term.lobe!r} has no option {option!r}{has}")
    options: dict[str, object] = {}
    for option in term.options:
        field, value = expr.OPTIONS[option]
        if options.setdefault(field, value) != value:
            raise expr.ModelError(
                f"lobe {term.lobe!r}: of {', '.join(term.options)} more than one says its "
                f"{field.replace('_', ' ')}"
            )
    retro, back = options.pop("retro", False), options.pop("back", False)
    lobe = cls(**options)
    lobe = Retro(lobe) if retro else lobe
    return TurnedOver(lobe) if back else lobe


@functools.cache
def _n_basis(lobe: Lobe) -> int:
    # Tracing a lobe takes milliseconds, and its answer never changes.
    shape = {p.name: 0.5 for p in lobe.parameters() if not p.coefficient}
    normal = from_angles([0.0], 0.0, [0.0], 0.0)
    return len(jax.eval_shape(lobe.basis, shape, normal))
