"""Lobes as plugins of Mitsuba 3, and sums of them as nested blends."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fitting.export.facets import Facets, facets_of
from fitting.export.mitsuba_file import Colour, Tree
from fitting.export.parts import Lobes, Part, Values, sum_of
from fitting.models import Way

_REFLECTION: tuple[Way, ...] = ("front",)
# A part that is nearly black is still sampled now and then.
_LEAST_SHARE = 0.05


@dataclass(frozen=True)
class Plugin:
    """A plugin for one lobe.

    - ``build``: the plugin with its value multiplied by a factor.
    - ``term``: what it computes, as a lobe of this program and its values.
    - ``light``: about the share of light that it scatters, for sampling.
    - ``exact``: whether it is the lobe itself.
    - ``faithful``: whether Mitsuba computes the term itself.
    """

    build: Callable[[float], Tree]
    term: tuple[str, Values]
    light: float
    ways: tuple[Way, ...] = _REFLECTION
    remarks: tuple[str, ...] = ()
    exact: bool = True
    faithful: bool = True


@dataclass(frozen=True)
class Sum:
    """A tree of plugins, what it computes, and the ways of light that it knows.

    ``exact`` where every plugin is the lobe that it stands for, ``faithful`` where
    Mitsuba computes the representation itself.
    """

    tree: Tree
    representation: Lobes
    ways: tuple[Way, ...]
    remarks: tuple[str, ...]
    exact: bool
    faithful: bool


def sum_of_plugins(parts: Sequence[Part]) -> Sum | str:
    """The sum of lobes by ``blendbsdf``, or a sentence on the lobe that has no plugin."""
    plugins: list[Plugin] = []
    for part in parts:
        own = _plugins_of(part)
        if own is None:
            return f"Mitsuba has no plugin for {part.term}"
        plugins += own
    plugins, turned = _in_one_frame(plugins)
    shares = np.maximum([p.light for p in plugins], 0.0)
    shares = shares / shares.sum() if shares.sum() > 0 else np.ones(len(plugins))
    shares = np.maximum(shares, _LEAST_SHARE)
    ways: tuple[Way, ...] = tuple(dict.fromkeys(w for p in plugins for w in p.ways))
    remarks = dict.fromkeys(r for p in plugins for r in p.remarks)
    return Sum(
        _blend(plugins, shares / shares.sum()),
        sum_of([p.term for p in plugins]),
        ways,
        (*turned, *remarks),
        len(turned) < 2 and all(p.exact for p in plugins),
        all(p.faithful for p in plugins),
    )


def _blend(plugins: Sequence[Plugin], shares: np.ndarray) -> Tree:
    """``share_1 b_1 + (1 - share_1) (...)`` with ``b_j`` times ``1 / weight_j``.

    Weights are rounded to what the file holds first, so that the factors undo them.
    """
    trees: list[Tree] = []
    weights: list[float] = []
    left = 1.0
    for plugin, share in zip(plugins[:-1], shares[:-1], strict=True):
        weight = float(f"{1.0 - share / left:.6g}")
        own = left * (1.0 - weight)
        trees.append(plugin.build(1.0 / own))
        weights.append(weight)
        left -= own
    tree = plugins[-1].build(1.0 / left)
    for weight, first in zip(reversed(weights), reversed(trees), strict=True):
        tree = {"type": "blendbsdf", "weight": weight, "first": first, "second": tree}
    return tree


def _plugins_of(part: Part) -> list[Plugin] | None:
    facets = facets_of(part)
    if facets is not None:
        return _of_facets(facets)
    of_name = {
        "lambert": _diffuse,
        "burley": _burley,
        "interfaced_lambert": _plastic,
        "lambert_transmission": _translucent,
        "rough_dielectric": _rough_dielectric,
    }
    build = of_name.get(part.term.lobe)
    if build is None or part.has("back") or part.has("media"):
        return None
    if any(v.ndim and np.ptp(v) > 0 for n, v in part.values.items() if _is_shape(part, n)):
        return None
    return [build(part)]


def _is_shape(part: Part, name: str) -> bool:
    return any(p.name == name and not p.coefficient for p in part.lobe.parameters())


def _diffuse(part: Part) -> Plugin:
    albedo = part.values["albedo"]

    def build(factor: float) -> Tree:
        return {"type": "diffuse", "reflectance": Colour(factor * albedo)}

    return Plugin(build, ("lambert", part.values), float(np.mean(albedo)))


def _burley(part: Part) -> Plugin:
    """The principled diffuse base alone: with ``specular`` 0 the index is 1."""
    albedo, roughness = part.values["albedo"], _scalar(part.values["roughness"])

    def build(factor: float) -> Tree:
        return {
            "type": "principled", "base_color": Colour(factor * albedo),
            "roughness": roughness, "specular": 0.0,
        }  # fmt: skip

    return Plugin(build, ("burley", part.values), float(np.mean(albedo)))


def _plastic(part: Part) -> Plugin:
    """The body of ``plastic`` without its mirror; the albedo undoes its fitted ``K``.

    Mitsuba's mean internal reflectance is Egan and Hilgeman's fit of 1973, up to 0.0014
    off; what counts is ``rho / (1 - rho K)``, from which ``rho`` follows for any ``K``.
    """
    eta, albedo = _scalar(part.values["eta"]), part.values["albedo"]
    fitted = -1.4399 / eta**2 + 0.7099 / eta + 0.6681 + 0.0636 * eta
    exact = _internal_reflectance(eta)
    amplitude = albedo / (1.0 - albedo * exact)

    def build(factor: float) -> Tree:
        x = factor * amplitude
        return {
            "type": "plastic", "int_ior": eta, "ext_ior": 1.0, "nonlinear": True,
            "diffuse_reflectance": Colour(x / (1.0 + x * fitted)),
            "specular_reflectance": 0.0,
        }  # fmt: skip

    return Plugin(build, ("interfaced_lambert", part.values), float(np.mean(albedo)))


def _internal_reflectance(eta: float) -> float:
    import jax
    import jax.numpy as jnp

    from fitting.models.interfaced_lambert import mean_transmittance

    with jax.enable_x64(True):
        return 1.0 - float(mean_transmittance(jnp.asarray(eta))) / eta**2


def _translucent(part: Part) -> Plugin:
    """``principledthin`` that transmits all of its diffuse light: ``diff_trans`` 2."""
    through = part.values["transmittance"]

    def build(factor: float) -> Tree:
        return {
            "type": "principledthin", "base_color": Colour(factor * through),
            "spec_trans": 0.0, "diff_trans": 2.0,
        }  # fmt: skip

    return Plugin(
        build, ("lambert_transmission", part.values), float(np.mean(through)),
        ways=("down", "up"),
    )  # fmt: skip


def _rough_dielectric(part: Part) -> Plugin:
    reflected, transmitted = part.values["reflected"], part.values["transmitted"]
    options = [o for o in ("aniso", "beckmann") if part.has(o)]
    kind = "beckmann" if part.has("beckmann") else "ggx"

    def build(factor: float) -> Tree:
        return {
            "type": "roughdielectric", "distribution": kind, **_widths(part.values),
            "int_ior": _scalar(part.values["eta"]), "ext_ior": 1.0,
            "specular_reflectance": Colour(factor * reflected),
            "specular_transmittance": Colour(factor * transmitted),
        }  # fmt: skip

    term = f"rough_dielectric({', '.join(options)})" if options else "rough_dielectric"
    return Plugin(
        build, (term, part.values), float(np.mean([reflected, transmitted])),
        ways=("front", "back", "down", "up"), remarks=_of_beckmann(kind),
        faithful=kind != "beckmann",
    )  # fmt: skip


def _of_facets(facets: Facets) -> list[Plugin]:
    """One conductor, or two that together have the lobe's Fresnel term."""
    remarks = [*facets.remarks, *_of_beckmann(facets.distribution)]
    if not facets.exact:
        remarks.append(
            f"the Fresnel term of {facets.part.term} became that of conductors with the "
            "same facets, which follow it within 2 % where it rises towards grazing"
        )
    if facets.shadowing != "uncorrelated":
        remarks.append(
            f"the shadowing of {facets.part.term} ({facets.shadowing}) became Mitsuba's, "
            "Smith's for both directions on their own"
        )
    aniso = "aniso, " if "alpha_x" in facets.widths else ""
    term = f"{facets.distribution}({aniso}uncorrelated, conductor)"
    return [_conductor(facets, own, term, tuple(remarks)) for own in facets.conductors]


def _conductor(facets: Facets, own: Values, term: str, remarks: tuple[str, ...]) -> Plugin:
    def build(factor: float) -> Tree:
        return {
            "type": "roughconductor", "distribution": facets.distribution,
            **_widths(facets.widths),
            "eta": Colour(own["eta"], index=True), "k": Colour(own["k"], index=True),
            "specular_reflectance": Colour(factor * own["scale"]),
        }  # fmt: skip

    normal = ((own["eta"] - 1) ** 2 + own["k"] ** 2) / (
        (own["eta"] + 1) ** 2 + own["k"] ** 2
    )
    # What Schlick's curve adds on average over the hemisphere.
    light = float(np.mean(own["scale"] * (normal + (1.0 - normal) / 21.0)))
    exact = facets.exact and facets.shadowing == "uncorrelated" and not facets.remarks
    return Plugin(
        build, (term, {**facets.widths, **own}), light, remarks=remarks, exact=exact,
        faithful=facets.distribution != "beckmann",
    )  # fmt: skip


def _in_one_frame(plugins: list[Plugin]) -> tuple[list[Plugin], tuple[str, ...]]:
    """All anisotropic plugins with the tangent of the first: a surface has one frame."""
    angles = [float(p.term[1]["angle"]) for p in plugins if "angle" in p.term[1]]
    if not angles:
        return plugins, ()
    said = [
        f"alpha_u lies at the azimuth {np.degrees(angles[0]):.4g} deg of the fit: turn the "
        "texture coordinates, of which it follows dp/du, by as much"
    ]
    if np.ptp(angles) > 1e-12:
        said.append("the lobes' tangents differ; all are given that of the first")
    out: list[Plugin] = []
    for p in plugins:
        term, values = p.term
        if "angle" in values:
            values = {**values, "angle": np.asarray(angles[0])}
        out.append(dataclasses.replace(p, term=(term, values)))
    return out, tuple(said)


def _of_beckmann(kind: str) -> tuple[str, ...]:
    if kind != "beckmann":
        return ()
    return (
        "Mitsuba's masking of Beckmann facets is a rational fit of the exact one, up to "
        "0.3 % off in each direction, which the distance does not include",
    )


def _widths(values: Values) -> dict[str, Any]:
    if "alpha" in values:
        return {"alpha": _scalar(values["alpha"])}
    return {"alpha_u": _scalar(values["alpha_x"]), "alpha_v": _scalar(values["alpha_y"])}


def _scalar(value: np.ndarray) -> float:
    return float(f"{np.ravel(value)[0]:.9g}")
