"""Facet lobes as renderers hold them: GGX or Beckmann, and conductors for Fresnel."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Literal, cast

import numpy as np

from fitting.export import conductor_curve
from fitting.export.parts import Part, Values
from fitting.models.microfacet import Options

_NEGLIGIBLE = 1e-6


@dataclass(frozen=True)
class Facets:
    """A lobe of GGX or Beckmann facets, single scattering, from the front.

    ``widths`` are ``alpha``, or ``alpha_x, alpha_y, angle``, the same for all channels;
    ``remarks`` say where the lobe's were not.
    """

    part: Part
    distribution: Literal["ggx", "beckmann"]
    widths: Values
    remarks: tuple[str, ...]

    @property
    def exact(self) -> bool:
        """Whether its Fresnel term is that of a conductor or a dielectric."""
        own = self.options.fresnel in ("conductor", "dielectric")
        return own and self.part.curve is None

    @property
    def curve(self) -> np.ndarray:
        """Its Fresnel term ``(n, c)`` at `conductor_curve.nodes`."""
        if self.part.curve is not None:
            return self.part.curve
        cosines = conductor_curve.nodes()
        return conductor_curve.reflectance(self.options, self.part.values, cosines)

    @functools.cached_property
    def conductors(self) -> list[Values]:
        """``eta, k, scale`` of conductors that sum up to its Fresnel term, each ``(c,)``.

        A dielectric is a conductor with ``k = 0``; other terms are followed by two.
        """
        own = self.part.values
        if self.exact:
            k = own.get("k", np.zeros(own["scale"].shape))
            found = [{"eta": own["eta"], "k": k, "scale": own["scale"]}]
        else:
            cosines = conductor_curve.nodes()
            found = list(conductor_curve.two_conductors(self.curve, cosines))
        channels = found[0]["scale"].shape
        top = max(float(np.max(c["scale"])) for c in found)
        wide = [{n: np.broadcast_to(v, channels) for n, v in c.items()} for c in found]
        kept = [c for c in wide if np.max(c["scale"]) > _NEGLIGIBLE * top]
        return kept or wide[:1]

    @property
    def shadowing(self) -> str:
        """Of the lobe, by its option."""
        return self.options.shadowing

    @property
    def options(self) -> Options:
        return cast(Options, self.part.lobe)


def facets_of(part: Part) -> Facets | None:
    """The lobe as facets; None if it is another one, is turned, or scatters twice."""
    if not (part.named("ggx") or part.named("beckmann")) or part.has("ms"):
        return None
    names = ("alpha",) if "alpha" in part.values else ("alpha_x", "alpha_y", "angle")
    widths, remarks = {}, []
    for name in names:
        value = part.values[name]
        if value.ndim and np.ptp(value) > 0:
            remarks.append(
                f"{part.term}: {name} differs between the channels ({value.min():.3g} to "
                f"{value.max():.3g}); the target has one, the geometric mean"
            )
            value = np.exp(np.mean(np.log(np.maximum(value, 1e-12))))
        widths[name] = np.asarray(np.ravel(value)[0])
    kind = cast(Literal["ggx", "beckmann"], part.term.lobe)
    return Facets(part, kind, widths, tuple(remarks))
