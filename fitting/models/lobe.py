"""The contract of a lobe, which every file of this folder fulfils."""

from __future__ import annotations

import abc
from collections.abc import Mapping
from typing import ClassVar, NamedTuple

import equinox as eqx
from jaxtyping import Array, Float

from fitting.geometry import Geometry
from fitting.parameters import Parameter

Shape = Mapping[str, Float[Array, ""]]


class SlopeWidths(NamedTuple):
    """A peak where the half vector is the normal, and how wide it is in slope space."""

    alpha_x: Float[Array, ""]
    alpha_y: Float[Array, ""]
    angle: Float[Array, ""]


class AxisPeak(NamedTuple):
    """A peak along ``(c_xy wo_x, c_xy wo_y, c_z wo_z)``, like ``cos^exponent`` around it.

    ``c_xy = -1, c_z = 1`` is the mirror direction, ``c_xy = c_z = 1`` the way back.
    """

    c_xy: Float[Array, ""]
    c_z: Float[Array, ""]
    exponent: Float[Array, ""]


Peak = SlopeWidths | AxisPeak | None


class Lobe(eqx.Module):
    """One term of a model: ``f = sum_j amplitude_j(coefficients, shape) basis_j(shape)``.

    A lobe knows its parameters and its basis functions of the geometry. It knows nothing
    of files, objectives or solvers. Its fields are options (static), never parameters.

    - ``NAME``: how users write it in a model expression.
    - ``REFERENCE``: the paper, to the equation number.
    - ``RECIPROCAL``: whether ``f(wi, wo) = f(wo, wi)`` for all parameters.
    - ``LINEAR``: whether the amplitudes are the coefficients themselves, so that the best
      coefficients of a quadratic objective follow from the shape in closed form; an
      option may make them nonlinear, which `linear` tells.
    - ``ALBEDO_BOUND``: an upper bound of the directional albedo with the largest
      coefficient at 1, or None where there is none.
    - ``NONNEGATIVE``: whether no basis function is ever below zero.
    - ``RETRO``: whether the option ``retro`` makes sense, which turns the peak around.
    - ``PER_ANGLE``: whether it calls `Geometry.over_angles`, so that a table of the polar
      angles that occur is worth its making.
    """

    NAME: ClassVar[str]
    REFERENCE: ClassVar[str]
    RECIPROCAL: ClassVar[bool]
    LINEAR: ClassVar[bool]
    ALBEDO_BOUND: ClassVar[float | None]
    NONNEGATIVE: ClassVar[bool] = True
    RETRO: ClassVar[bool] = False
    PER_ANGLE: ClassVar[bool] = False

    @property
    def linear(self) -> bool:
        """`LINEAR`, with the options that this lobe has."""
        return self.LINEAR

    @property
    def albedo_bound(self) -> float | None:
        """`ALBEDO_BOUND`, with the options that this lobe has."""
        return self.ALBEDO_BOUND

    @property
    def relative_error(self) -> float:
        """What series and quadratures leave of the values, apart from rounding."""
        return 0.0

    @abc.abstractmethod
    def parameters(self) -> tuple[Parameter, ...]:
        """The parameters, shape parameters and coefficients, in the order of printing."""

    @abc.abstractmethod
    def basis(self, shape: Shape, geometry: Geometry) -> tuple[Array, ...]:
        """The basis functions, 1/sr, each of the shape of the geometry's arrays.

        Finite, with finite derivatives, over the whole closed domain; zero where the
        source or the detector is below the horizon.
        """

    @abc.abstractmethod
    def amplitudes(
        self, shape: Shape, coefficients: tuple[Array, ...]
    ) -> tuple[Array, ...]:
        """One factor per basis function, from the coefficients (each ``(c,)``)."""

    @abc.abstractmethod
    def peak(self, shape: Shape) -> Peak:
        """Where the albedo's quadrature needs its nodes; None for a broad, smooth lobe."""
