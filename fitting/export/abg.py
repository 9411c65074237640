"""ABg parameters (`.txt`): scatter of polished optics, for OpticStudio, FRED and others.

Conventions of the ABg model: `BSDF = A / (B + |beta - beta0|^g)` in 1/sr, with the
projected directions of the detector and of the specular beam; `g = 0` is a Lambertian
surface, `A / (B + 1)`. TIS is its integral over the projected solid angle at normal
incidence. Parameters are the same at all angles of incidence. OpticStudio keeps them in a
catalogue that is edited in its ABg dialog, and adds several of them by an ABg file whose
weights are absolute; the catalogue's own format is not published, so that this is a table
to enter, one line per wavelength and lobe.

Exact are `lambert`, `abg`, and `harvey_shack` with the slope -2. Anything else is refitted,
by `abg` alone or, if that is not close, by `lambert + abg`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from scipy.special import hyp2f1

from data_formats import Channel
from fitting.export.channels import as_fitted
from fitting.export.closest import Candidate, closest, ways_left_out
from fitting.export.parts import Part, parts_of, parts_of_lobes, sum_of
from fitting.export.refit import refit
from fitting.export.surface import Surface, surface_of
from fitting.export.target import Product, Request, Say
from fitting.result import FitResult

NAME = "abg"
SUFFIXES = (".txt",)
OPTIONS = ()
REPRESENTATIONS = ()

_CONVENTIONS = (
    "BSDF = A / (B + |beta - beta0|^g), 1/sr without cosine; lobes of a wavelength add up",
)
# Of `harvey_shack`: its profile is ABg's with g = 2 for this slope alone.
_SLOPE = -2.0
_SAME = 1e-9
Line = tuple[str, np.ndarray, np.ndarray, np.ndarray]


def make(result: FitResult, request: Request, path: Path, say: Say) -> Product:
    """The fit as lines of A, B and g. Raises `ExportError`."""
    mixing = as_fitted(result.channels)
    surface = surface_of(result, mixing)
    chosen = closest(surface, _candidates(surface, say))

    def write(target: Path, comment: Sequence[str]) -> None:
        text = _text(chosen.content, surface.channels, comment)
        target.write_text(text, encoding="utf-8")

    return Product(
        surface=surface,
        representation=chosen.representation,
        ways=chosen.ways,
        conventions=(*_CONVENTIONS, mixing.sentence),
        remarks=(*chosen.remarks, *ways_left_out(surface, chosen.ways, "ABg")),
        write=write,
    )


def _candidates(surface: Surface, say: Say) -> Iterator[Candidate]:
    parts, _ = parts_of(surface)
    lines = [_line(part) for part in parts]
    if all(line is not None for line in lines):
        terms = [(str(part.term), part.values) for part in parts]
        yield Candidate("own", sum_of(terms), lines, final=True)
        return
    for expression in ("abg", "lambert + abg"):
        lobes = refit(surface, expression, say)
        found = [_line(part) for part in parts_of_lobes(lobes)]
        said = (f"{surface.model.expression} was refitted by {expression}",)
        yield Candidate(expression, lobes, found, remarks=said)


def _line(part: Part) -> Line | None:
    """``A (c,)``, ``B`` and ``g`` of a lobe; None if it is no ABg."""
    v = part.values
    if part.named("lambert"):
        # With B = 1, A / (B + 1) = albedo / pi.
        return "lambert", 2.0 * v["albedo"] / np.pi, np.asarray(1.0), np.asarray(0.0)
    if part.named("abg"):
        b = v["shoulder"] ** v["g"]
        return "abg", v["b0"] * b, b, v["g"]
    own = part.named("harvey_shack") and not part.has("spectral")
    if own and np.all(np.abs(v["slope"] - _SLOPE) < _SAME):
        b = v["shoulder"] ** 2
        return "harvey_shack", v["b0"] * b, b, np.asarray(2.0)
    return None


def _text(
    lines: Sequence[Line], channels: Sequence[Channel], comment: Sequence[str]
) -> str:
    out = [f"# {line}" for line in comment]
    out.append("# channel\tlobe\twavelength_um\tangle_deg\tA\tB\tg\tTIS")
    for c, channel in enumerate(channels):
        nm = channel.wavelength_nm
        # OpticStudio does not scale with the wavelength where it is 0.
        um = f"{nm / 1000.0:.6g}" if nm is not None else "0"
        for name, a, b, g in lines:
            a, b, g = (float(np.broadcast_to(x, len(channels))[c]) for x in (a, b, g))
            numbers = f"{a:.9g}\t{b:.9g}\t{g:.9g}\t{integrated(a, b, g):.6g}"
            out.append(f"{channel.name}\t{name}\t{um}\t0\t{numbers}")
    return "\n".join([*out, ""])


def integrated(a: float, b: float, g: float) -> float:
    """Total integrated scatter at normal incidence, ``2 pi int_0^1 A / (B + x^g) x dx``.

    ``pi A / B 2F1(1, 2 / g; 1 + 2 / g; -1 / B)``.
    """
    if g == 0.0:
        return np.pi * a / (b + 1.0)
    if b == 0.0:
        return np.inf if g >= 2.0 else 2.0 * np.pi * a / (2.0 - g)
    return float(np.pi * a / b * hyp2f1(1.0, 2.0 / g, 1.0 + 2.0 / g, -1.0 / b))
