"""What all lobes around the half vector share: widths, tangent frame, options."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple, Protocol

import jax.numpy as jnp
from jaxtyping import Array

from fitting.expression import ModelError
from fitting.geometry import Geometry
from fitting.models import fresnel, multiple_scattering, shadowing
from fitting.models.lobe import Shape, SlopeWidths
from fitting.models.quotients import reciprocal
from fitting.parameters import Parameter, shape

ALPHA_SUPPORT = (1e-4, 1.5)


class Facets(NamedTuple):
    """A distribution of facets: ``density(h2, hz, area)`` and ``cos_lambda(t2, cosine)``.

    Both of stretched lengths (see `Stretched`), ``t2`` being ``i2`` or ``o2``.
    """

    density: Callable[[Array, Array, Array], Array]
    cos_lambda: Callable[[Array, Array], Array]


class Options(Protocol):
    """The options of a microfacet lobe, as its fields."""

    @property
    def fresnel(self) -> fresnel.Fresnel: ...
    @property
    def shadowing(self) -> shadowing.Shadowing: ...
    @property
    def multiple_scattering(self) -> bool: ...


def width_parameters(anisotropic: bool) -> tuple[Parameter, ...]:
    """``alpha``, or ``alpha_x, alpha_y`` and the angle of the tangent frame."""
    if not anisotropic:
        return (
            shape("alpha", 0.2, ALPHA_SUPPORT, "microfacet slope width", start=(0.01, 1.0)),
        )
    return (
        shape(
            "alpha_x", 0.2, ALPHA_SUPPORT, "slope width along the tangent",
            start=(0.02, 0.8),
        ),
        shape(
            "alpha_y", 0.3, ALPHA_SUPPORT, "slope width across the tangent",
            start=(0.02, 0.8),
        ),
        shape(
            "angle", 0.4, (0.0, math.pi), "azimuth of the tangent",
            unit="rad", scale="periodic", start=(0.0, math.pi),
        ),
    )  # fmt: skip


def slope_widths(parameters: Shape) -> SlopeWidths:
    """The widths as three numbers, whether isotropic or not."""
    if "alpha" in parameters:
        alpha = parameters["alpha"]
        return SlopeWidths(alpha, alpha, jnp.zeros_like(alpha))
    return SlopeWidths(parameters["alpha_x"], parameters["alpha_y"], parameters["angle"])


def check(anisotropic: bool, options: Options) -> None:
    """Refuse options that do not go together, with `ModelError`."""
    if not options.multiple_scattering:
        return
    if anisotropic:
        raise ModelError("option 'ms' is for isotropic lobes: leave 'aniso' out")
    if options.shadowing not in ("correlated", "uncorrelated"):
        raise ModelError(f"option 'ms' needs Smith's shadowing, not {options.shadowing!r}")


def basis(options: Options, facets: Facets, shape: Shape, g: Geometry) -> tuple[Array, ...]:
    """``D(h) V F(cos_d)`` split by Fresnel's coefficients (Walter et al. 2007, eq. 20)."""
    single = single_scattering(options.shadowing, facets, shape)
    terms = fresnel.split(options.fresnel, shape, single(g), g.cos_d)
    if not options.multiple_scattering:
        return terms
    lost = multiple_scattering.Lost(single, shape["alpha"])
    return (*terms, lost.basis(g))


def amplitudes(
    options: Options, facets: Facets, shape: Shape, coefficients: tuple[Array, ...]
) -> tuple[Array, ...]:
    """Factors of the basis functions."""
    direct = fresnel.amplitudes(options.fresnel, coefficients)
    if not options.multiple_scattering:
        return direct
    single = single_scattering(options.shadowing, facets, shape)
    lost = multiple_scattering.Lost(single, shape["alpha"])
    average = fresnel.average(options.fresnel, shape, coefficients)
    return (*direct, lost.amplitude(average))


def linear(options: Options) -> bool:
    """Whether the amplitudes are the coefficients themselves."""
    return fresnel.linear(options.fresnel) and not options.multiple_scattering


def single_scattering(
    kind: shadowing.Shadowing, facets: Facets, shape: Shape
) -> Callable[[Geometry], Array]:
    """Single scattering of facets that reflect everything, ``D V``, 1/sr."""

    def value(g: Geometry) -> Array:
        up = g.reflects
        s = stretched(shape, g)
        d = facets.density(s.h2, g.hz, s.area)

        def cos_lambda() -> tuple[Array, Array]:
            if "alpha" not in shape:
                return (
                    facets.cos_lambda(s.i2, abs(g.cos_i)),
                    facets.cos_lambda(s.o2, abs(g.cos_o)),
                )
            a2 = shape["alpha"] ** 2
            return g.over_angles(lambda sine2, c: facets.cos_lambda(sine2 * a2, c))

        v = shadowing.visibility(kind, g, up, cos_lambda)
        return jnp.where(up, d * v, 0.0)

    return value


class Stretched(NamedTuple):
    """Squared tangential lengths after the stretch that makes a width of 1.

    ``h2 = (hx/ax)^2 + (hy/ay)^2``, ``i2 = (ax wix)^2 + (ay wiy)^2``, ``o2`` likewise for
    ``wo``, all in the tangent frame; ``area = ax ay``.
    """

    h2: Array
    i2: Array
    o2: Array
    area: Array


def stretched(parameters: Shape, g: Geometry) -> Stretched:
    """Half vector and directions in the frame where the distribution is round."""
    if "alpha" in parameters:
        alpha = parameters["alpha"]
        a2 = alpha**2
        # Not divided by alpha^2: the derivative would pass through alpha^-4, and overflow.
        narrow = reciprocal(alpha)
        return Stretched(
            (g.hx * narrow) ** 2 + (g.hy * narrow) ** 2,
            (g.wix**2 + g.wiy**2) * a2,
            (g.wox**2 + g.woy**2) * a2,
            a2,
        )
    ax, ay, angle = slope_widths(parameters)
    c, s = jnp.cos(angle), jnp.sin(angle)

    def along(x: Array, y: Array) -> tuple[Array, Array]:
        return c * x + s * y, c * y - s * x

    hx, hy = along(g.hx, g.hy)
    ix, iy = along(g.wix, g.wiy)
    ox, oy = along(g.wox, g.woy)
    return Stretched(
        (hx * reciprocal(ax)) ** 2 + (hy * reciprocal(ay)) ** 2,
        (ax * ix) ** 2 + (ay * iy) ** 2,
        (ax * ox) ** 2 + (ay * oy) ** 2,
        ax * ay,
    )
