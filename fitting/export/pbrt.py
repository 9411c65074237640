"""pbrt-v4: named materials as text, for `Include` before a shape.

Conventions of pbrt-v4: `roughness` is the slope width of facets only with `"bool
remaproughness" false`, which is written; else pbrt takes its root for it. Facets are GGX
with height-correlated masking. `"rgb"` values are linear sRGB (pbrt's default colour space)
and at most 1 for a `diffuse`; `"spectrum"` values are pairs of nm and value, zero outside.
Materials scatter alike on both sides, and what is transmitted is in radiance.

`mix` takes one of two materials by chance, `(1 - amount) a + amount b` on average: weights
add up to 1, so that a sum is exact only while diffuse albedo and facets together reflect at
most 1 from any angle. Facets get what the albedo leaves; their Fresnel curves, by two
conductors each, end at that share instead of 1 towards grazing. `coateddiffuse`, a random
walk between a rough interface and a matt body, is close to `interfaced_lambert + ggx(
dielectric)` of one index.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from fitting.export.channels import as_fitted, linear_srgb
from fitting.export.closest import Candidate, closest, ways_left_out
from fitting.export.parts import parts_of, parts_of_lobes
from fitting.export.pbrt_file import as_text
from fitting.export.pbrt_materials import coated_diffuse, mixed
from fitting.export.refit import refit
from fitting.export.surface import Surface, surface_of
from fitting.export.target import ExportError, Product, Request, Say
from fitting.result import FitResult

NAME = "pbrt"
SUFFIXES = (".pbrt",)
OPTIONS = ("representation", "spectral", "channels", "illuminant")
REPRESENTATIONS = ("mix", "coateddiffuse")

_CONVENTIONS = (
    "roughness is the slope width of facets itself: remaproughness is false",
    "the syntax follows pbrt-v4's description of its files; pbrt itself was not run",
)


def make(result: FitResult, request: Request, path: Path, say: Say) -> Product:
    """The fit as materials of pbrt. Raises `ExportError`."""
    if request.spectral:
        if any(c.wavelength_nm is None for c in result.channels):
            raise ExportError(
                "--spectral: the channels of the fit are bands and no wavelengths; leave "
                "it out for linear sRGB"
            )
        mixing = as_fitted(result.channels)
        colour = "spectra in nm, constant beyond the first and last wavelength"
    else:
        mixing = linear_srgb(result.channels, request.channels, request.illuminant)
        colour = (
            f"colours are linear sRGB, which pbrt turns into spectra: {mixing.sentence}"
        )
    surface = surface_of(result, mixing)
    chosen = closest(surface, _candidates(surface, request, say))

    def write(target: Path, comment: Sequence[str]) -> None:
        name = path.name.partition(".")[0] or "material"
        text = as_text(name, chosen.content, surface.channels, comment)
        target.write_text(text, encoding="utf-8")

    return Product(
        surface=surface,
        representation=chosen.representation,
        ways=chosen.ways,
        conventions=(*_CONVENTIONS, colour),
        remarks=(*chosen.remarks, *ways_left_out(surface, chosen.ways, "this material")),
        write=write,
        faithful=chosen.faithful,
    )


def _candidates(surface: Surface, request: Request, say: Say) -> Iterator[Candidate]:
    wanted = request.representation
    parts, remarks = parts_of(surface)
    own = coated_diffuse(parts, remarks)
    if own is not None and wanted != "mix":
        yield own
    if wanted in (None, "mix"):
        found = mixed(parts, remarks)
        if not isinstance(found, Candidate):
            kind = "(aniso)" if surface.model.anisotropic else ""
            lobes = refit(surface, f"lambert + 2*ggx{kind}", say)
            said = [f"{found}; the model was refitted by {lobes.words}"]
            found = mixed(parts_of_lobes(lobes), said)
        assert isinstance(found, Candidate)
        yield found
    if own is None and wanted in (None, "coateddiffuse"):
        lobes = refit(
            surface, "interfaced_lambert + ggx(dielectric)", say,
            fix={"ggx.scale": 1.0}, tie={"ggx.eta": "interfaced_lambert.eta"},
        )  # fmt: skip
        said = [f"{surface.model.expression} was refitted by {lobes.words} of one index"]
        coated = coated_diffuse(parts_of_lobes(lobes), said)
        assert coated is not None
        yield coated
