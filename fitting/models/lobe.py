"""The contract of a lobe, which every file of this folder fulfils."""

from __future__ import annotations

import abc
from collections.abc import Mapping
from typing import ClassVar, Literal, NamedTuple

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


class Passage(NamedTuple):
    """Where transmitted light peaks: at facets of these widths, which refract it.

    ``eta`` is the index of the medium behind the surface relative to the one in front.
    Without it the peak is straight on, the mirror image of one of reflected light.
    """

    widths: SlopeWidths
    eta: Float[Array, ""] | None = None


# The ways of light: reflected at the front or at the back of the sample, and through it
# from front to back or from back to front.
Way = Literal["front", "back", "down", "up"]
FROM_FRONT: tuple[Way, ...] = ("front", "down")
FROM_BACK: tuple[Way, ...] = ("back", "up")
THROUGH: tuple[Way, ...] = ("down", "up")
TURNED_OVER: dict[Way, Way] = {"front": "back", "back": "front", "down": "up", "up": "down"}


class Lobe(eqx.Module):
    """One term of a model: ``f = sum_j amplitude_j(coefficients, shape) basis_j(shape)``.

    A lobe knows its parameters and its basis functions of the geometry. It knows nothing
    of files, objectives or solvers. Its fields are options (static), never parameters.

    - ``NAME``: how users write it in a model expression.
    - ``REFERENCE``: the paper, to the equation number.
    - ``WAYS``: the ways of light that it knows; on others its basis functions are zero.
    - ``RECIPROCAL``: whether ``f(wi, wo) / n_o^2 = f(wo, wi) / n_i^2`` for all parameters,
      ``n_i, n_o`` being the indices of the media of source and detector.
    - ``LINEAR``: whether the amplitudes are the coefficients themselves, so that the best
      coefficients of a quadratic objective follow from the shape in closed form; an
      option may make them nonlinear, which `linear` tells.
    - ``ALBEDO_BOUND``: an upper bound of the directional albedo, reflected and transmitted
      light together, with the largest coefficient at 1, or None where there is none.
    - ``NONNEGATIVE``: whether no basis function is ever below zero.
    - ``RETRO``: whether the option ``retro`` makes sense, which turns the peak around.
    - ``PER_ANGLE``: whether it calls `Geometry.over_angles`, so that a table of the polar
      angles that occur is worth its making.
    """

    NAME: ClassVar[str]
    REFERENCE: ClassVar[str]
    WAYS: ClassVar[tuple[Way, ...]] = ("front",)
    RECIPROCAL: ClassVar[bool]
    LINEAR: ClassVar[bool]
    ALBEDO_BOUND: ClassVar[float | None]
    NONNEGATIVE: ClassVar[bool] = True
    RETRO: ClassVar[bool] = False
    PER_ANGLE: ClassVar[bool] = False

    @property
    def ways(self) -> tuple[Way, ...]:
        """`WAYS`, as this lobe lies in the sample."""
        return self.WAYS

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

        Finite, with finite derivatives, over the whole closed domain; zero on the ways of
        light that are not among `WAYS`, such as below the horizon.
        """

    @abc.abstractmethod
    def amplitudes(
        self, shape: Shape, coefficients: tuple[Array, ...]
    ) -> tuple[Array, ...]:
        """One factor per basis function, from the coefficients (each ``(c,)``)."""

    @abc.abstractmethod
    def peak(self, shape: Shape) -> Peak:
        """Where the albedo's quadrature needs its nodes; None for a broad, smooth lobe."""

    def passage(self, shape: Shape) -> Passage | None:
        """Where transmitted light peaks and needs nodes; None if it is broad."""
        return None

    def relative_index(self, shape: Shape) -> Array | float:
        """Index of the medium behind the surface relative to the one in front of it.

        For the reciprocity of transmitted light. Walter et al. 2007, sec. 4.2.
        """
        return 1.0
