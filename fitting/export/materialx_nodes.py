"""Lobes as BSDF nodes of MaterialX, and their sum as a graph."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fitting import expression as expr
from fitting.export import conductor_curve, mtlx_file
from fitting.export.mtlx_file import Value
from fitting.export.parts import Lobes, Part, Values, sum_of
from fitting.model import Model
from fitting.models import Way

_SAME = 1e-9
# Where metals dip before grazing, acos(1/7) = 81.8 degrees.
_DIP = 1.0 / 7.0


@dataclass(frozen=True)
class Node:
    """A BSDF node, a colour that multiplies it, and what the two compute."""

    category: str
    inputs: dict[str, Value]
    term: tuple[str, Values]
    factor: np.ndarray | None = None
    ways: tuple[Way, ...] = ("front",)
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True)
class Graph:
    """Nodes that are added, and what they compute together."""

    nodes: tuple[Node, ...]
    representation: Lobes
    ways: tuple[Way, ...]
    remarks: tuple[str, ...]

    def document(self, name: str, comment: Sequence[str]) -> str:
        """The text of a document with one material of that name."""
        root, own = mtlx_file.document(), mtlx_file.identifier(name)
        last = ""
        for k, node in enumerate(self.nodes, start=1):
            part = f"{own}_{k}"
            mtlx_file.add_node(root, node.category, part, "BSDF", node.inputs)
            if node.factor is not None:
                scaled = f"{part}_scaled"
                factor: dict[str, Value] = {"in2": node.factor}
                mtlx_file.add_node(root, "multiply", scaled, "BSDF", factor)
                mtlx_file.connect(root, scaled, "in1", "BSDF", part)
                part = scaled
            if last:
                total = f"{own}_sum_{k}"
                mtlx_file.add_node(root, "add", total, "BSDF", {})
                mtlx_file.connect(root, total, "in1", "BSDF", last)
                mtlx_file.connect(root, total, "in2", "BSDF", part)
                part = total
            last = part
        shader = f"{own}_surface"
        mtlx_file.add_node(root, "surface", shader, "surfaceshader", {})
        mtlx_file.connect(root, shader, "bsdf", "BSDF", last)
        mtlx_file.add_node(root, "surfacematerial", own, "material", {})
        mtlx_file.connect(root, own, "surfaceshader", "surfaceshader", shader)
        return mtlx_file.text_of(root, comment)


def graph_of(parts: Sequence[Part]) -> Graph | str:
    """The sum of lobes, or a sentence on the lobe that has no node."""
    nodes: list[Node] = []
    for part in parts:
        own = _node_of(part)
        if own is None:
            return f"MaterialX has no node for {part.term}"
        nodes.append(own)
    ways: tuple[Way, ...] = tuple(dict.fromkeys(w for n in nodes for w in n.ways))
    remarks = tuple(dict.fromkeys(r for n in nodes for r in n.remarks))
    return Graph(tuple(nodes), sum_of([n.term for n in nodes]), ways, remarks)


def _node_of(part: Part) -> Node | None:
    shapes = [p.name for p in part.lobe.parameters() if not p.coefficient]
    varying = [n for n in shapes if part.values[n].ndim and np.ptp(part.values[n]) > _SAME]
    if part.has("back") or part.has("ms") or part.has("media"):
        return None
    if set(varying) - ({"eta", "k"} if part.has("conductor") else set()):
        return None
    if part.term.lobe == "ggx":
        return _of_facets(part)
    if part.has("retro"):
        return None
    v = part.values
    if part.term.lobe == "lambert_transmission":
        ways: tuple[Way, ...] = ("down", "up")
        return Node(
            "translucent_bsdf",
            {"color": v["transmittance"]},
            (str(part.term), v),
            ways=ways,
        )
    of_name: dict[str, tuple[str, dict[str, Value]]] = {
        "lambert": ("oren_nayar_diffuse_bsdf", {}),
        "oren_nayar": ("oren_nayar_diffuse_bsdf", {"energy_compensation": False}),
        "eon": ("oren_nayar_diffuse_bsdf", {"energy_compensation": True}),
        "burley": ("burley_diffuse_bsdf", {}),
    }
    if part.term.lobe not in of_name:
        return None
    category, inputs = of_name[part.term.lobe]
    rough = v.get("roughness", v.get("sigma", np.zeros(1)))
    inputs = {"color": v["albedo"], "roughness": _scalar(rough), **inputs}
    return Node(category, inputs, (str(part.term), v))


def _of_facets(part: Part) -> Node:
    v = part.values
    options = [
        o for o in part.term.options if o not in ("uncorrelated", "v_cavity", "bare")
    ]
    remarks: list[str] = []
    if len(options) < len(part.term.options):
        remarks.append(
            f"the shadowing of {part.term} became MaterialX's, Smith's with correlated "
            "heights"
        )
    if part.curve is not None:
        return _of_curve(part, part.curve)
    if "alpha" in v:
        widths = np.repeat(_scalar(v["alpha"]), 2)
    else:
        widths = np.array([_scalar(v["alpha_x"]), _scalar(v["alpha_y"])])
        angle = np.degrees(_scalar(v["angle"]))
        remarks.append(
            f"the first roughness lies at the azimuth {angle:.4g} deg of the fit: turn the "
            "tangent by as much"
        )
    inputs: dict[str, Value] = {"roughness": widths, "distribution": "ggx"}
    if part.has("retro"):
        inputs["retroreflective"] = True
    term = "ggx" + (f"({', '.join(options)})" if options else "")
    factor: np.ndarray | None = None
    if part.has("dielectric"):
        category = "dielectric_bsdf"
        inputs |= {"ior": _scalar(v["eta"]), "tint": v["scale"], "scatter_mode": "R"}
    elif part.has("conductor"):
        category = "conductor_bsdf"
        channels = v["scale"].shape
        inputs |= {
            "ior": np.array(np.broadcast_to(v["eta"], channels)),
            "extinction": np.array(np.broadcast_to(v["k"], channels)),
        }
        factor = None if np.all(v["scale"] == 1.0) else v["scale"]
    else:
        category = "generalized_schlick_bsdf"
        inputs |= {"color0": v["f0"], "color90": v["f90"]}
        inputs |= {"color82": v["tint"]} if "tint" in v else {}
        inputs |= {"exponent": _scalar(v["power"])} if "power" in v else {}
    return Node(category, inputs, (term, v), factor, remarks=tuple(remarks))


def _of_curve(part: Part, curve: np.ndarray) -> Node:
    """Facets with a Fresnel curve of their own, by the closest of generalised Schlick's
    with the dip of metals (Kutz et al. 2021), which is linear in its amplitudes."""
    c = conductor_curve.nodes()
    q, dip = (1.0 - c) ** 5, c * (1.0 - c) ** 6 / (_DIP * (1.0 - _DIP) ** 6)
    weight = np.sqrt(c)[:, None]
    basis = np.stack([1.0 - q, q, -dip], axis=1)
    f0, f90, less = np.linalg.lstsq(weight * basis, weight * curve, rcond=None)[0]
    f0, f90 = np.maximum(f0, 0.0), np.maximum(f90, 0.0)
    at_dip = f0 * (1.0 - (1.0 - _DIP) ** 5) + f90 * (1.0 - _DIP) ** 5
    tint = np.clip(1.0 - less / np.maximum(at_dip, 1e-12), 0.0, 1.0)
    kept = [o for o in part.term.options if o not in ("conductor", "dielectric")]
    shapes = {n: part.values[n] for n in part.values if n.startswith(("alpha", "angle"))}
    values = {**shapes, "f0": f0, "f90": f90, "tint": tint}
    term = expr.Term("ggx", (*kept, "f82"))
    (lobe,) = Model(str(term)).lobes
    node = _of_facets(Part(term, lobe, values))
    said = (
        f"the Fresnel term of {part.term}, which differs over the wavelengths, became that "
        "of generalised Schlick with F82-tint in three colours"
    )
    return dataclasses.replace(node, remarks=(*node.remarks, said))


def _scalar(value: np.ndarray) -> float:
    return float(np.ravel(value)[0])
