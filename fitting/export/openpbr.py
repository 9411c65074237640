"""OpenPBR Surface 1.1 in MaterialX (`.mtlx`): the opaque base, for film and games.

Conventions of OpenPBR 1.1: `specular_roughness` is the root of the slope width of facets;
`base_color` is linear (`lin_rec709`); `base_diffuse_roughness` is EON's. The highlight
takes its directional albedo, seen from the detector, from the base, which is not
reciprocal. A fit of the lobe `openpbr` is written as it is; anything else is refitted by
it. Coat, fuzz, thin film, subsurface and transmission stay at their defaults, which are 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from fitting.export import mtlx_file
from fitting.export.channels import linear_srgb
from fitting.export.closest import ways_left_out
from fitting.export.mtlx_file import Value
from fitting.export.one_lobe import one_lobe
from fitting.export.surface import surface_of
from fitting.export.target import Product, Request, Say
from fitting.result import FitResult

NAME = "openpbr"
SUFFIXES = (".mtlx",)
OPTIONS = ("channels", "illuminant")
REPRESENTATIONS = ()

_CONVENTIONS = (
    "specular_roughness is the root of the slope width of facets",
    "values are linear, base_color too: no screen encoding",
)


def make(result: FitResult, request: Request, path: Path, say: Say) -> Product:
    """The fit as `open_pbr_surface`. Raises `ExportError`."""
    mixing = linear_srgb(result.channels, request.channels, request.illuminant)
    surface = surface_of(result, mixing)
    found = one_lobe(surface, "openpbr", say)

    def write(target: Path, comment: Sequence[str]) -> None:
        root = mtlx_file.document()
        own = mtlx_file.identifier(path.name.partition(".")[0] or "material")
        inputs: dict[str, Value] = {
            n: v if v.ndim else float(v) for n, v in found.values.items()
        }
        shader = f"{own}_surface"
        mtlx_file.add_node(root, "open_pbr_surface", shader, "surfaceshader", inputs)
        mtlx_file.add_node(root, "surfacematerial", own, "material", {})
        mtlx_file.connect(root, own, "surfaceshader", "surfaceshader", shader)
        target.write_text(mtlx_file.text_of(root, comment), encoding="utf-8")

    return Product(
        surface=surface,
        representation=found.representation,
        ways=("front",),
        conventions=(*_CONVENTIONS, f"colours: {mixing.sentence}"),
        remarks=(*found.remarks, *ways_left_out(surface, ("front",), NAME)),
        write=write,
    )
