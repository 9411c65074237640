"""Mitsuba 3: a `bsdf` as XML, or as the dict of `mi.load_dict` in JSON.

Conventions of Mitsuba 3 (version 3.9): `alpha` is the slope width of facets, not its root;
the masking of `ggx` and `beckmann` is Smith's for both directions on their own, and
Beckmann's is Walter's rational fit, up to 0.3 % off. `eval` includes the cosine. `alpha_u`
lies along `dp/du`. Colours are linear sRGB, in `srgb` textures with `unbounded` where they
exceed 1; spectra are `wavelength:value` in nm. In radiance, `wi` is the detector.

There is no plain sum, but `blendbsdf` is `(1 - w) a + w b`: every part is scaled by one
over its weight and the sum is exact. Weights are the parts' shares of the light, so that
sampling follows them. Of the lobes

- `lambert`, `burley`, `interfaced_lambert`, `lambert_transmission`, `rough_dielectric` and
  `ggx` and `beckmann` with the options `uncorrelated` and `conductor` or `dielectric` are
  exact (a dielectric is a conductor with `k = 0`, which transmits nothing);
- other `ggx` and `beckmann` become conductors whose Fresnel curves are within 2 % of
  Schlick's, with Mitsuba's masking in place of theirs;
- anything else is refitted, as a sum of those or as `principled`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from fitting.export.channels import as_fitted, linear_srgb
from fitting.export.closest import Candidate, closest, ways_left_out
from fitting.export.mitsuba_file import as_json, as_xml
from fitting.export.mitsuba_plugins import Sum, sum_of_plugins
from fitting.export.mitsuba_principled import principled
from fitting.export.parts import parts_of, parts_of_lobes
from fitting.export.refit import refit
from fitting.export.surface import Surface, surface_of
from fitting.export.target import ExportError, Product, Request, Say
from fitting.result import FitResult

NAME = "mitsuba"
SUFFIXES = (".xml", ".json")
OPTIONS = ("representation", "spectral", "channels", "illuminant")
REPRESENTATIONS = ("sum", "principled")

_CONVENTIONS = (
    "alpha is the slope width of facets (not its root); values are those of the BSDF, and "
    "Mitsuba's eval multiplies them by the cosine",
)


def make(result: FitResult, request: Request, path: Path, say: Say) -> Product:
    """The fit as a BSDF of Mitsuba. Raises `ExportError`."""
    if request.spectral:
        if any(c.wavelength_nm is None for c in result.channels):
            raise ExportError(
                "--spectral: the channels of the fit are bands and no wavelengths; leave "
                "it out for linear sRGB"
            )
        mixing = as_fitted(result.channels)
        colour = (
            "spectra, constant beyond the first and last wavelength; for a spectral "
            "variant such as scalar_spectral"
        )
    else:
        mixing = linear_srgb(result.channels, request.channels, request.illuminant)
        colour = f"colours are linear sRGB: {mixing.sentence}"
    surface = surface_of(result, mixing)
    chosen = closest(surface, _candidates(surface, request, say))

    def write(target: Path, comment: Sequence[str]) -> None:
        text = as_json if path.suffix.lower() == ".json" else as_xml
        target.write_text(text(chosen.content, surface.channels, comment), encoding="utf-8")

    return Product(
        surface=surface,
        representation=chosen.representation,
        ways=chosen.ways,
        conventions=(*_CONVENTIONS, colour),
        remarks=(*chosen.remarks, *ways_left_out(surface, chosen.ways, "this BSDF")),
        write=write,
        faithful=chosen.faithful,
    )


def _candidates(surface: Surface, request: Request, say: Say) -> Iterator[Candidate]:
    """What Mitsuba could be given, the most faithful first."""
    wanted = request.representation
    parts, remarks = parts_of(surface)
    if wanted in (None, "sum"):
        found = sum_of_plugins(parts)
        # Disney's lobe alone is what `principled` is for.
        if isinstance(found, Sum):
            yield _candidate(found, remarks)
        elif wanted or not parts[0].named("disney"):
            kind = "aniso, uncorrelated" if surface.model.anisotropic else "uncorrelated"
            lobes = refit(surface, f"lambert + 2*ggx({kind})", say)
            again = sum_of_plugins(parts_of_lobes(lobes))
            assert isinstance(again, Sum)
            yield _candidate(again, [f"{found}; the model was refitted by {lobes.words}"])
    if wanted in (None, "principled"):
        yield principled(surface, parts, say)


def _candidate(found: Sum, remarks: list[str]) -> Candidate:
    said = (*remarks, *found.remarks)
    return Candidate(
        "sum", found.representation, found.tree, found.ways, said,
        final=found.exact, faithful=found.faithful,
    )  # fmt: skip
