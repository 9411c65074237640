"""Blender: a Python snippet that makes a Principled BSDF material (`.py`).

Conventions of Blender's Principled BSDF since 4.3: `Roughness` is the root of the slope
width of facets; `Base Color` is linear; `IOR` sets the dielectric's reflectance at normal
incidence with `Specular IOR Level` at its neutral 0.5; `Diffuse Roughness` makes the base
Oren-Nayar. It follows OpenPBR's base, whose lobe `openpbr` is fitted: a fit of that lobe
is written as it is, anything else is refitted by it. The distribution is set to single
scattering, which is what was fitted, in place of Blender's multiscatter.

Cycles of Blender 4.5 agrees with the lobe to 1e-5 for a metal, to 0.5 % for a dielectric
on a Lambertian base (2.5 % towards a grazing detector), and to 3 % on a rough one, whose
Oren-Nayar is another than EON.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from fitting.export.channels import linear_srgb
from fitting.export.closest import ways_left_out
from fitting.export.one_lobe import OneLobe, one_lobe
from fitting.export.surface import surface_of
from fitting.export.target import Product, Request, Say
from fitting.result import FitResult

NAME = "blender"
SUFFIXES = (".py",)
OPTIONS = ("channels", "illuminant")
REPRESENTATIONS = ()

_CONVENTIONS = (
    "Roughness is the root of the slope width of facets",
    "colours are linear, as Blender's sockets take them",
)

_SCRIPT = """\
import bpy

material = bpy.data.materials.new({name!r})
material.use_nodes = True
tree = material.node_tree
tree.nodes.clear()
shader = tree.nodes.new("ShaderNodeBsdfPrincipled")
output = tree.nodes.new("ShaderNodeOutputMaterial")
tree.links.new(shader.outputs["BSDF"], output.inputs["Surface"])
shader.distribution = "GGX"
values = {{
    "Base Color": ({red!r}, {green!r}, {blue!r}, 1.0),
    "Metallic": {metallic!r},
    "Roughness": {roughness!r},
    "IOR": {ior!r},
    "Diffuse Roughness": {diffuse!r},
}}
for name, value in values.items():
    if name in shader.inputs:
        shader.inputs[name].default_value = value
    else:
        print(f"{{material.name}}: this Blender has no input {{name!r}}, of {{value}}")
"""


def make(result: FitResult, request: Request, path: Path, say: Say) -> Product:
    """The fit as a script for Blender. Raises `ExportError`."""
    mixing = linear_srgb(result.channels, request.channels, request.illuminant)
    surface = surface_of(result, mixing)
    found = one_lobe(surface, "openpbr", say)

    def write(target: Path, comment: Sequence[str]) -> None:
        name = path.name.partition(".")[0] or "material"
        head = "".join(f"# {line}\n" for line in comment)
        target.write_text(f"{head}\n{_script(name, found)}", encoding="utf-8")

    return Product(
        surface=surface,
        representation=found.representation,
        ways=("front",),
        conventions=(*_CONVENTIONS, f"colours: {mixing.sentence}"),
        remarks=(
            *found.remarks,
            *_remark(found),
            *ways_left_out(surface, ("front",), "this material"),
        ),
        write=write,
        faithful=found["base_metalness"] == 1.0,
    )


def _remark(found: OneLobe) -> tuple[str, ...]:
    if found["base_metalness"] == 1.0:
        return ()
    return (
        "Cycles (Blender 4.5) is up to 0.5 % from OpenPBR's formula for a dielectric, 2.5 "
        "% towards a grazing detector and 3 % with a rough base, which the distance does "
        "not include",
    )


def _script(name: str, found: OneLobe) -> str:
    red, green, blue = found.base_color
    return _SCRIPT.format(
        name=name, red=red, green=green, blue=blue,
        metallic=found["base_metalness"], roughness=found["specular_roughness"],
        ior=found["specular_ior"], diffuse=found["base_diffuse_roughness"],
    )  # fmt: skip
