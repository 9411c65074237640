"""The sums as matrix products of features, which may differ by channel."""

from __future__ import annotations

import jax.numpy as jnp
from jaxtyping import Array

from fitting import qp
from fitting.row_sums.sums import Sums, pairs, symmetric


def weighted(weights: Array, features: Array) -> Array:
    """``(c, n)`` from weights ``(c, f)`` of features that channels share, or do not."""
    if features.ndim == 2:
        return weights @ features
    return qp.product(jnp.swapaxes(features, 1, 2), weights)


def moments(weights: Array, features: Array) -> Array:
    """``(c, f)``: features times weights ``(c, n)``, summed over the rows."""
    return weighted(weights, jnp.swapaxes(features, -1, -2))


def contracted(features: Array, r: Array, d: Array) -> Sums:
    """The sums of features, residuals and their slopes ``(c, n)``."""
    half = half_gram(features, d * d)
    gram = symmetric(half, features.shape[-2])
    return Sums(gram, moments(d * r, features), jnp.sum(r * r))


def half_gram(features: Array, weights: Array) -> Array:
    """Upper halves ``(c, h)`` of the features' Gram matrices under weights ``(c, n)``."""
    upper = pairs(features.shape[-2])
    return moments(weights, features[..., upper[0], :] * features[..., upper[1], :])
