"""Conductors whose Fresnel curves together come closest to another curve."""

from __future__ import annotations

import functools

import jax
import jax.numpy as jnp
import numpy as np
from scipy.optimize import least_squares

from fitting.models import fresnel
from fitting.models.microfacet import Options

Values = dict[str, np.ndarray]
_NODES = 48
# log of eta and k: a transparent rim with a metal nearly the same at all angles, and two
# transparent ones.
_STARTS = ((1.2, 1e-3, 2.0, 6.0), (1.1, 1e-3, 1.5, 1e-3))
_ETA, _K = (0.05, 10.0), (1e-4, 50.0)
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
    each = [_together(curve[:, [c]], cos_d, np.inf) for c in range(curve.shape[1])]
    first, second = (
        {n: np.concatenate([np.atleast_1d(e[j][n]) for e in each]) for n in each[0][j]}
        for j in range(2)
    )
    return first, second


def sharing_scales(
    curve: np.ndarray, cos_d: np.ndarray, most: float
) -> tuple[Values, Values]:
    """The same with ``eta, k (c,)`` and one scale for all channels, of a sum up to
    ``most``, above which the curve cannot be followed."""
    return _together(curve, cos_d, most)


def _together(curve: np.ndarray, cos_d: np.ndarray, most: float) -> tuple[Values, Values]:
    channels = curve.shape[1]
    nothing = {"eta": np.full(channels, 1.5), "k": np.zeros(channels)}
    top = float(np.max(curve))
    if not top > _LEAST:
        return tuple({**nothing, "scale": np.asarray(0.0)} for _ in range(2))  # type: ignore
    least = 0.02 * np.maximum(curve.max(axis=0), _LEAST)
    weight = np.sqrt(cos_d)[:, None] / np.maximum(curve, least)
    value, slope = _compiled()
    limit = np.log(min(most, 1e3))
    bounds = _bounds(channels, limit)
    best = None
    with jax.enable_x64(True):
        for start in _STARTS:
            rim = float(np.clip(np.log(np.max(curve)), bounds[0][0], limit - 1e-3))
            own = np.repeat(np.log(start), channels)
            # The metal's share is what is left at the normal.
            share = np.clip(np.max(curve[-1]) / top, 0.02, 0.98)
            found = least_squares(
                lambda p: (weight * (np.asarray(value(p, cos_d)) - curve)).ravel(),
                np.clip([rim, np.log((1 - share) / share), *own], *bounds),
                lambda p: (  # pyright: ignore[reportArgumentType]
                    weight[..., None] * np.asarray(slope(p, cos_d))
                ).reshape(-1, p.size),
                bounds=bounds,
            )
            if best is None or found.cost < best.cost:
                best = found
    assert best is not None
    total, split = np.exp(best.x[0]), 1.0 / (1.0 + np.exp(-best.x[1]))
    eta1, k1, eta2, k2 = np.exp(best.x[2:]).reshape(4, channels)
    return (
        {"eta": eta1, "k": k1, "scale": np.asarray(total * split)},
        {"eta": eta2, "k": k2, "scale": np.asarray(total * (1.0 - split))},
    )


def _bounds(channels: int, limit: float) -> tuple[np.ndarray, np.ndarray]:
    low = [-30.0, -20.0, *np.repeat(np.log([_ETA[0], _K[0]] * 2), channels)]
    high = [limit, 20.0, *np.repeat(np.log([_ETA[1], _K[1]] * 2), channels)]
    return np.array(low), np.array(high)


@functools.cache
def _compiled():
    """``(n, c)`` of two conductors, and its Jacobian.

    By the logarithm of the sum of their scales, the logit of the first one's share, and
    the logarithms of ``eta, k`` of the first and of the second in all channels.
    """

    def value(p, cos_d):
        eta1, k1, eta2, k2 = jnp.exp(p[2:]).reshape(4, -1)
        share, c = jax.nn.sigmoid(p[1]), cos_d[:, None]
        first = share * fresnel.conductor(c, eta1, k1)
        return jnp.exp(p[0]) * (first + (1.0 - share) * fresnel.conductor(c, eta2, k2))

    return jax.jit(value), jax.jit(jax.jacfwd(value))
