"""Lobes as materials of pbrt-v4, and sums of them as mixtures by chance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fitting.export import conductor_curve
from fitting.export.closest import Candidate
from fitting.export.facets import Facets, facets_of
from fitting.export.parts import Part, Values, sum_of
from fitting.export.pbrt_file import Leaf, Mix
from fitting.models import Way

# A pair of conductors needs a share of the mixture, however bright the base.
_LEAST_ROOM = 0.02
_SAME = 1e-6


def mixed(parts: Sequence[Part], remarks: Sequence[str]) -> Candidate | str:
    """The sum of lobes by ``mix``, or a sentence on the lobe that has no material."""
    facets: list[Facets] = []
    matt: dict[str, np.ndarray] = {}
    for part in parts:
        own = facets_of(part)
        coefficient = {"lambert": "albedo", "lambert_transmission": "transmittance"}
        if own is not None and own.distribution == "ggx":
            facets.append(own)
        elif part.term.lobe in coefficient and not part.term.options:
            value = part.values[coefficient[part.term.lobe]]
            matt[part.term.lobe] = matt.get(part.term.lobe, 0.0) + value
        else:
            return f"pbrt has no material for {part.term}"
    brightest = max((float(np.max(v)) for v in matt.values()), default=0.0)
    room = max(1.0 - brightest, _LEAST_ROOM)
    said = list(remarks)
    leaves = _conductors(facets, room, said)
    rest = 1.0 - sum(leaf.weight for leaf in leaves)
    channels = max(v.size for part in parts for v in part.values.values())
    base, terms, ways = _base(matt, rest, channels, said)
    tree: Leaf | Mix = base
    done = rest
    for leaf in leaves:
        done += leaf.weight
        tree = Mix(tree, leaf.material, leaf.weight / done)
    if len(leaves) > 1:
        said.append("a mixture of mixtures: pbrt's GPU renderer does not take it")
    terms = [*terms, *(leaf.term for leaf in leaves)]
    return Candidate("mix", sum_of(terms), tree, ways, tuple(said), final=not facets)


@dataclass(frozen=True)
class _Weighted:
    """A material with its share of the mixture, and what the two amount to."""

    material: Leaf
    weight: float
    term: tuple[str, Values]


def _conductors(facets: Sequence[Facets], room: float, said: list[str]) -> list[_Weighted]:
    """Two conductors per lobe, or one where that is the lobe itself.

    Every lobe gets its part of the room, by how much it reflects at the most.
    """
    cosines = conductor_curve.nodes()
    curves = [f.curve for f in facets]
    tops = [max(float(np.max(c)), 1e-9) for c in curves]
    out: list[_Weighted] = []
    for own, curve, top in zip(facets, curves, tops, strict=True):
        said += own.remarks
        most = room * top / sum(tops)
        scales = own.conductors[0]["scale"] if own.exact else None
        if scales is not None and np.ptp(scales) < _SAME and np.max(scales) <= most + _SAME:
            found = [own.conductors[0] | {"scale": np.asarray(np.max(scales))}]
        else:
            found = list(conductor_curve.sharing_scales(curve, cosines, most))
            said.append(
                f"the Fresnel term of {own.part.term} became that of two conductors with "
                f"the weights {float(found[0]['scale']):.3g} and "
                f"{float(found[1]['scale']):.3g}"
                + ("; it ends at their sum towards grazing" if top > most else "")
            )
        if own.shadowing != "correlated":
            said.append(
                f"the shadowing of {own.part.term} ({own.shadowing}) became pbrt's, "
                "Smith's with correlated heights"
            )
        if "angle" in own.widths:
            angle = np.degrees(own.widths["angle"])
            said.append(
                f"uroughness lies at the azimuth {angle:.4g} deg of the fit: turn the "
                "texture coordinates by as much"
            )
        aniso = "aniso, " if "alpha_x" in own.widths else ""
        for values in found:
            weight = float(values["scale"])
            if weight < _SAME:
                continue
            wide = np.broadcast_to(weight, values["eta"].shape)
            term = {**own.widths, **values, "scale": wide}
            out.append(
                _Weighted(_conductor(own, values), weight, (f"ggx({aniso}conductor)", term))
            )
    return out


def _conductor(facets: Facets, values: Values) -> Leaf:
    w = {n: float(v) for n, v in facets.widths.items()}
    widths = (
        {"roughness": w["alpha"]}
        if "alpha" in w
        else {"uroughness": w["alpha_x"], "vroughness": w["alpha_y"]}
    )
    own = {"eta": np.asarray(values["eta"]), "k": np.asarray(values["k"])}
    return Leaf("conductor", {**own, **widths, "remaproughness": False})


def _base(
    matt: dict[str, np.ndarray], weight: float, channels: int, said: list[str]
) -> tuple[Leaf, list[tuple[str, Values]], tuple[Way, ...]]:
    """What is matt, as one material of a weight, brighter by one over it."""
    colours = {n: np.clip(v / weight, 0.0, 1.0) for n, v in matt.items()}
    off = max(
        (float(np.max(v - weight * colours[n])) for n, v in matt.items()), default=0.0
    )
    if off > 1e-9:
        said.append(
            f"the matt part was taken down by {off:.2g}: with the facets it would reflect "
            "more than all of the light"
        )
    names = {"lambert": "albedo", "lambert_transmission": "transmittance"}
    terms = [(n, {names[n]: weight * v}) for n, v in colours.items()]
    if "lambert_transmission" in colours:
        black = np.zeros_like(colours["lambert_transmission"])
        own = {
            "reflectance": colours.get("lambert", black),
            "transmittance": colours["lambert_transmission"],
        }
        return Leaf("diffusetransmission", {**own}), terms, ("front", "down", "up")
    matte = colours.get("lambert", np.zeros(channels))
    return Leaf("diffuse", {"reflectance": matte}), terms, ("front",)


def coated_diffuse(parts: Sequence[Part], remarks: Sequence[str]) -> Candidate | None:
    """``coateddiffuse`` for a matt body under a rough interface of the same index."""
    found = {p.term.lobe: p for p in parts}
    if len(parts) != 2 or set(found) != {"interfaced_lambert", "ggx"}:
        return None
    body, gloss = found["interfaced_lambert"], facets_of(found["ggx"])
    if gloss is None or not gloss.part.has("dielectric"):
        return None
    indices = np.concatenate(
        [np.ravel(body.values["eta"]), np.ravel(gloss.part.values["eta"])]
    )
    if np.ptp(indices) > _SAME or np.max(abs(gloss.part.values["scale"] - 1.0)) > _SAME:
        return None
    eta = float(indices[0])
    widths = _conductor(gloss, {"eta": np.asarray(eta), "k": np.asarray(0.0)}).parameters
    own = {n: v for n, v in widths.items() if n not in ("eta", "k")}
    leaf = Leaf("coateddiffuse", {"reflectance": body.values["albedo"], "eta": eta, **own})
    said = [
        *remarks,
        "pbrt walks at random between a rough interface and its body; the distance is that "
        "of the formula for a smooth interface, which a rough one departs from",
    ]
    kind = "aniso, dielectric" if "alpha_x" in gloss.widths else "dielectric"
    lobes = sum_of(
        [
            ("interfaced_lambert", body.values),
            (f"ggx({kind})", {**gloss.widths, "eta": np.asarray(eta),
                              "scale": gloss.part.values["scale"]}),
        ]
    )  # fmt: skip
    return Candidate("coateddiffuse", lobes, leaf, remarks=tuple(said), faithful=False)
