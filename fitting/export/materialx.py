"""MaterialX: a graph of its BSDF nodes (`.mtlx`), which hold sums of lobes as they are.

Conventions of MaterialX 1.39: the BSDF nodes take the slope widths of facets as
`roughness`, a vector of two (surface shaders such as OpenPBR take their root). Masking is
height-correlated, `color0`, `color82`, `color90` and `exponent` are those of generalised
Schlick with F82-tint, `oren_nayar_diffuse_bsdf` is Lambert's law at roughness 0, the
qualitative model of 1994 without `energy_compensation` and EON with it. `add` and
`multiply` of BSDFs are plain. Colours are linear, of the primaries of `lin_rec709`.

Of the lobes `lambert`, `oren_nayar`, `eon`, `burley`, `lambert_transmission`, and `ggx`
with any Fresnel term, correlated masking and the option `retro` are exact. Anything else is
refitted by `lambert + 2*ggx`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from fitting.export.channels import linear_srgb
from fitting.export.closest import Candidate, closest, ways_left_out
from fitting.export.materialx_nodes import Graph, graph_of
from fitting.export.parts import parts_of, parts_of_lobes
from fitting.export.refit import refit
from fitting.export.surface import Surface, surface_of
from fitting.export.target import Product, Request, Say
from fitting.result import FitResult

NAME = "materialx"
SUFFIXES = (".mtlx",)
OPTIONS = ("channels", "illuminant")
REPRESENTATIONS = ()

_CONVENTIONS = (
    "roughness of the BSDF nodes is the slope width of facets (not its root)",
    "single scattering as fitted; a renderer that adds what facets scatter more than once, "
    "as MaterialX's own GLSL does, is brighter for wide lobes",
)


def make(result: FitResult, request: Request, path: Path, say: Say) -> Product:
    """The fit as a graph of BSDF nodes. Raises `ExportError`."""
    mixing = linear_srgb(result.channels, request.channels, request.illuminant)
    surface = surface_of(result, mixing)
    chosen = closest(surface, _candidates(surface, say))
    graph: Graph = chosen.content

    def write(target: Path, comment: Sequence[str]) -> None:
        name = path.name.partition(".")[0] or "material"
        target.write_text(graph.document(name, comment), encoding="utf-8")

    return Product(
        surface=surface,
        representation=chosen.representation,
        ways=chosen.ways,
        conventions=(*_CONVENTIONS, f"colours are lin_rec709: {mixing.sentence}"),
        remarks=(*chosen.remarks, *ways_left_out(surface, chosen.ways, "this graph")),
        write=write,
    )


def _candidates(surface: Surface, say: Say) -> Iterator[Candidate]:
    parts, remarks = parts_of(surface)
    found = graph_of(parts)
    if isinstance(found, Graph):
        yield _candidate(found, remarks)
        return
    kind = "(aniso)" if surface.model.anisotropic else ""
    lobes = refit(surface, f"lambert + 2*ggx{kind}", say)
    again = graph_of(parts_of_lobes(lobes))
    assert isinstance(again, Graph)
    yield _candidate(again, [f"{found}; the model was refitted by {lobes.words}"])


def _candidate(graph: Graph, remarks: list[str]) -> Candidate:
    said = (*remarks, *graph.remarks)
    return Candidate("nodes", graph.representation, graph, graph.ways, said)
