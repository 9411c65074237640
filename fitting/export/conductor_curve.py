"""Conductors whose Fresnel curves together come closest to another curve."""

from __future__ import annotations

import functools

import jax
import jax.numpy as jnp
import numpy as np
from scipy.optimize import least_squares

from fitting.export.parts import Values
from fitting.models import fresnel
from fitting.models.microfacet import Options

_NODES = 48
# log of eta, k and scale: a transparent rim and a metal nearly the same at all angles; and
# two transparent ones.
_STARTS = (
    (np.log(1.2), np.log(1e-3), np.log(2.0), np.log(6.0)),
    (np.log(1.1), np.log(1e-3), np.log(1.5), np.log(1e-3)),
)
_ETA, _K = (np.log(0.05), np.log(10.0)), (np.log(1e-4), np.log(50.0))
_LEAST = 1e-7


def reflectance(lobe: Options, values: Values, cos_d: np.ndarray) -> np.ndarray:
    """``F (n, c)`` of a facet lobe at cosines ``(n,)``, its factor included."""
    with jax.enable_x64(True):
        shape = {
            n: jnp.atleast_1d(jnp.asarray(v, dtype=jnp.float64)) for n, v in values.items()
        }
        cosine = jnp.asarray(cos_d, dtype=jnp.float64)[:, None]
        terms = fresnel.split(lobe.fresnel, shape, jnp.ones_like(cosine), cosine)
        names = [p.name for p in fresnel.parameters(lobe.fresnel) if p.coefficient]
        factors = fresnel.amplitudes(lobe.fresnel, tuple(shape[n] for n in names))
        return np.asarray(sum(t * a for t, a in zip(terms, factors, strict=True)))


def nodes() -> np.ndarray:
    """Cosines at which curves are compared: Gauss-Legendre's on [0, 1]."""
    return 0.5 * (np.polynomial.legendre.leggauss(_NODES)[0] + 1.0)


def two_conductors(curve: np.ndarray, cos_d: np.ndarray) -> tuple[Values, Values]:
    """``sum_j scale_j F(eta_j, k_j)`` near ``curve (n, c)``, each value ``(c,)``.

    Least squares of relative deviations at ``cos_d (n,)``, weighted by the cosine, since
    facets are seen in projection. Two of them follow a rising curve of Schlick's within 2
    %; one is 20 % off. A curve that falls towards grazing is followed by none.
    """
    found = [_two(curve[:, c], cos_d) for c in range(curve.shape[1])]
    p = np.array(found)
    return tuple(  # pyright: ignore[reportReturnType]
        {"eta": p[:, 3 * j], "k": p[:, 3 * j + 1], "scale": p[:, 3 * j + 2]}
        for j in range(2)
    )


def _two(curve: np.ndarray, cos_d: np.ndarray) -> np.ndarray:
    top = float(np.max(curve))
    if not top > _LEAST:
        return np.array([1.5, 0.0, 0.0, 1.5, 0.0, 0.0])
    weight = np.sqrt(cos_d) / np.maximum(curve, 0.02 * top)
    value, slope = _compiled()
    low = [_ETA[0], _K[0], -30.0] * 2
    high = [_ETA[1], _K[1], np.log(1e3)] * 2
    best = None
    with jax.enable_x64(True):
        for first_eta, first_k, second_eta, second_k in _STARTS:
            # Scales that share the curve at grazing and at the normal.
            rim, rest = max(curve[0], _LEAST), max(curve[-1], _LEAST)
            start = [first_eta, first_k, np.log(rim), second_eta, second_k, np.log(rest)]
            found = least_squares(
                lambda p: weight * (np.asarray(value(p, cos_d)) - curve),
                start,
                lambda p: weight[:, None] * np.asarray(slope(p, cos_d)),  # pyright: ignore
                bounds=(low, high),
            )
            if best is None or found.cost < best.cost:
                best = found
    assert best is not None
    return np.exp(best.x)


@functools.cache
def _compiled():
    """The sum of two conductors by the logarithms of their parameters, and its Jacobian."""

    def value(p, cos_d):
        q = jnp.exp(p)
        first = q[2] * fresnel.conductor(cos_d, q[0], q[1])
        return first + q[5] * fresnel.conductor(cos_d, q[3], q[4])

    return jax.jit(value), jax.jit(jax.jacfwd(value))
