"""Reflectances and transmittances of a model: Nicodemus' nine and their factors."""

from __future__ import annotations

import math
from dataclasses import dataclass

import jax.numpy as jnp
import msgspec
import numpy as np
from jax import Array

from fitting.expression import ModelError
from fitting.models.lobe import Way
from fitting.reflectance.beams import (
    Beam,
    describe,
    is_thin,
    nicodemus_name,
    projected_solid_angle,
)
from fitting.reflectance.kernel import basis_sums, basis_table, padded_directions
from fitting.reflectance.nested import Nodes, Radiance, Setting, lobe_nodes
from fitting.reflectance.surface import (
    Surface,
    amplitude_slopes,
    lobe_amplitudes,
    surface_of_result,
)
from fitting.result import FitResult

TOLERANCE = 1e-6
# Nodes at a time, so that memory does not grow with them.
_BLOCK = 1 << 16


class Reflectance(msgspec.Struct, frozen=True):
    """A reflectance or transmittance, per channel.

    ``value`` is in ``unit``: a share of the light, or 1/sr where one direction is
    collected. ``factor`` is relative to the perfect diffuser in the same geometry.
    ``error_bound`` is of the value, from the quadrature; ``standard_uncertainty`` (k = 1)
    of the value and of the factor from the parameters of the fit, null without any.
    ``unit_factor`` is the factor of a value of 1, ``pi / Omega``. Of a measurement
    ``covered`` is the share of the projected solid angle that rows stand for, and
    ``extrapolated`` the part of the value that they do not; see `measured`.
    """

    name: str
    transmitted: bool
    side: str
    incident: str
    collected: str
    channels: list[str]
    unit: str
    value: list[float]
    factor: list[float]
    error_bound: list[float]
    standard_uncertainty: list[float] | None
    factor_uncertainty: list[float] | None
    covariance: list[list[float]] | None
    unit_factor: float
    without_uncertainty: list[str]
    tolerance: float
    converged: bool
    nodes: int
    method: str
    notes: list[str] = []
    extrapolated: list[float] | None = None
    covered: list[float] | None = None


METHOD = (
    "adaptive Gauss-Kronrod quadrature over the half vector, or around the peak of a lobe "
    "without one"
)


@dataclass(frozen=True)
class Rule:
    """Nodes and weights of a quantity, per lobe; a pure function of the parameters.

    ``rule(values)`` is the value ``(c,)`` for parameters as `fitting.Model` takes them,
    under ``jax.enable_x64``: differentiate it with ``jax.grad`` or ``jax.jacfwd``. The
    nodes suit the parameters that they were made for, and parameters near them.
    """

    surface: Surface
    lobes: tuple[int, ...]
    nodes: tuple[Nodes, ...]
    scale: float

    def __call__(self, values: dict[str, Array]) -> Array:
        model, total = self.surface.model, jnp.zeros(self.surface.channels)

        for index, nodes in zip(self.lobes, self.nodes, strict=True):
            own = model.of_lobe(index, values)
            lobe = model.lobes[index]
            shape = {
                p.name: jnp.asarray(own[p.name])
                for p in lobe.parameters()
                if not p.coefficient
            }
            wide = {
                n: jnp.broadcast_to(jnp.asarray(v), total.shape) for n, v in own.items()
            }
            integral = jnp.zeros(())
            for k in range(0, len(nodes.weight), _BLOCK):
                rows = slice(k, k + _BLOCK)
                w = jnp.asarray(nodes.weight[rows])
                geometry = padded_directions(nodes.wi[rows], nodes.wo[rows], w.size)
                integral = integral + basis_table(lobe, shape, geometry) @ w
            total = total + jnp.sum(lobe_amplitudes(lobe, wide) * integral, axis=0)
        return self.scale * total


def quantity(
    source: FitResult | Surface,
    incident: Beam,
    collected: Beam,
    *,
    side: str = "front",
    transmitted: bool = False,
    radiance: Radiance | None = None,
    tolerance: float = TOLERANCE,
) -> Reflectance:
    """A reflectance (or transmittance) and its factor, for any two beams.

    ``rho = int int f L dOmega_r dOmega_i / int L dOmega_i`` with ``dOmega = |cos| dw``
    (Nicodemus et al. 1977, eq. 10 and table 2); a direction is not integrated over, so
    that ``rho`` of a collected direction is in 1/sr. The factor is ``pi rho / Omega_r``,
    ``pi rho`` for a direction.

    - `side`: from where the light comes, ``front`` or ``back``.
    - `transmitted`: whether the collected beam is on the other side of the sample.
    - `radiance`: ``L(theta, phi)`` of the incident light at arrays ``(n,)`` in rad from the
      normal of its side, any unit; uniform if None. Not for a single direction.
    - `tolerance`: of the value, relative to the largest channel.

    Raises `ModelError` if the model knows no such light.
    """
    return rule_and_quantity(
        source, incident, collected, side=side, transmitted=transmitted,
        radiance=radiance, tolerance=tolerance,
    )[1]  # fmt: skip


def rule_and_quantity(
    source: FitResult | Surface,
    incident: Beam,
    collected: Beam,
    *,
    side: str = "front",
    transmitted: bool = False,
    radiance: Radiance | None = None,
    tolerance: float = TOLERANCE,
) -> tuple[Rule, Reflectance]:
    """As `quantity`, with the nodes, for derivatives."""
    surface = surface_of_result(source) if isinstance(source, FitResult) else source
    way = way_of(side, transmitted)
    if way not in surface.model.ways:
        what = "transmits no light" if transmitted else "reflects no light"
        raise ModelError(f"model {surface.model.expression!r} {what} from the {side}")
    if radiance is not None and is_thin(incident):
        raise ModelError("a radiance distribution needs an incident cone or hemisphere")
    if not 1e-12 <= tolerance <= 0.1:
        raise ModelError(f"the tolerance is {tolerance:g}; expected 1e-12 to 0.1")
    setting = Setting(incident, collected, side == "front", transmitted, radiance)
    lobes = tuple(i for i, o in enumerate(surface.model.lobes) if way in o.ways)
    nodes = tuple(
        lobe_nodes(
            surface.model.lobes[i], surface.lobe_shape(i), surface.amplitudes(i), setting,
            tolerance,
        )
        for i in lobes
    )  # fmt: skip
    scale = 1.0 / incident_total(incident, radiance)
    rule = Rule(surface, lobes, nodes, scale)
    unit_factor = math.pi
    if not is_thin(collected):
        unit_factor /= projected_solid_angle(collected)
    value, bound = _sums(rule)
    covariance = None
    known = surface.covariance
    if known is not None:
        covariance = known.of_channels(slopes(rule))
    sd = None if covariance is None else np.sqrt(np.diag(covariance))
    return rule, Reflectance(
        name=nicodemus_name(incident, collected),
        transmitted=transmitted,
        side=side,
        incident=describe(incident),
        collected=describe(collected),
        channels=list(surface.names),
        unit="1/sr" if is_thin(collected) else "1",
        value=value.tolist(),
        factor=(unit_factor * value).tolist(),
        error_bound=bound.tolist(),
        standard_uncertainty=None if sd is None else sd.tolist(),
        factor_uncertainty=None if sd is None else (unit_factor * sd).tolist(),
        covariance=None if covariance is None else covariance.tolist(),
        unit_factor=unit_factor,
        without_uncertainty=list(known.without) if known else [],
        tolerance=tolerance,
        converged=all(n.converged for n in nodes),
        nodes=sum(len(n.weight) for n in nodes),
        method=METHOD,
    )


def way_of(side: str, transmitted: bool) -> Way:
    """The way of light from a side. Raises `ModelError` for another side."""
    ways: dict[tuple[str, bool], Way] = {
        ("front", False): "front", ("back", False): "back",
        ("front", True): "down", ("back", True): "up",
    }  # fmt: skip
    if (side, transmitted) not in ways:
        raise ModelError(f"there is no side {side!r}; expected front or back")
    return ways[side, transmitted]


def incident_total(incident: Beam, radiance: Radiance | None) -> float:
    """``int L dOmega_i``, 1 for a direction. Raises `ModelError` if nothing is lit."""
    if is_thin(incident):
        return 1.0
    if radiance is None:
        return projected_solid_angle(incident)
    from fitting.reflectance.incident import irradiance

    total = irradiance(incident, radiance)
    if not total > 0:
        raise ModelError(f"the radiance sums to {total:g}; expected a positive number")
    return total


def slopes(rule: Rule) -> dict[str, np.ndarray]:
    """``d value_c / d parameter``, of the same channel, per parameter ``(c,)``."""
    surface = rule.surface
    out = {n: np.zeros(surface.channels) for n in surface.values}
    for index, nodes in zip(rule.lobes, rule.nodes, strict=True):
        lobe, label = surface.model.lobes[index], surface.model.labels[index]
        amplitude = surface.amplitudes(index)
        _, by_shape = basis_sums(
            lobe, surface.lobe_shape(index), nodes.wi, nodes.wo, nodes.weight
        )
        for name, slope in amplitude_slopes(surface, index).items():
            total = np.sum(slope * nodes.value, axis=0)
            if name in by_shape:
                total = total + np.sum(amplitude * by_shape[name], axis=0)
            out[f"{label}.{name}"] = rule.scale * np.broadcast_to(total, surface.channels)
    return out


def _sums(rule: Rule) -> tuple[np.ndarray, np.ndarray]:
    value, bound = np.zeros((2, rule.surface.channels))
    for index, nodes in zip(rule.lobes, rule.nodes, strict=True):
        amplitude = rule.surface.amplitudes(index)
        value += np.sum(amplitude * nodes.value, axis=0)
        bound += np.sum(np.abs(amplitude) * nodes.error, axis=0)
    return rule.scale * value, rule.scale * bound
