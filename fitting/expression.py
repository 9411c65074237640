"""Model expressions as a person writes them: ``lambert + 2*ggx(aniso, dielectric)``."""

from __future__ import annotations

import difflib
import re
from dataclasses import dataclass
from typing import Any

OPTIONS: dict[str, tuple[str, object]] = {
    "iso": ("anisotropic", False),
    "aniso": ("anisotropic", True),
    "schlick": ("fresnel", "schlick"),
    "dielectric": ("fresnel", "dielectric"),
    "conductor": ("fresnel", "conductor"),
    "f82": ("fresnel", "f82"),
    "generalised": ("fresnel", "generalised"),
    "correlated": ("shadowing", "correlated"),
    "uncorrelated": ("shadowing", "uncorrelated"),
    "v_cavity": ("shadowing", "v_cavity"),
    "bare": ("shadowing", "bare"),
    "ms": ("multiple_scattering", True),
    "spectral": ("spectral", True),
    "beckmann": ("distribution", "beckmann"),
    "two_widths": ("two_widths", True),
    "mixed": ("polarisation", "mixed"),
    "media": ("media", True),
    "retro": ("retro", True),
    "back": ("back", True),
}

MEANINGS: dict[str, str] = {
    "iso": "the same in every direction of the sample",
    "aniso": "two widths and the azimuth of the first",
    "schlick": "Schlick's Fresnel term with a free grazing value",
    "dielectric": "exact Fresnel term of a transparent material, by its index",
    "conductor": "exact Fresnel term of a metal; see --material",
    "f82": "Schlick's with the dip of metals at 81.8 degrees",
    "generalised": "Schlick's with a free exponent",
    "correlated": "Smith's shadowing for the heights of one surface",
    "uncorrelated": "Smith's shadowing, both directions on their own",
    "v_cavity": "shadowing of V-shaped grooves, as Cook and Torrance have it",
    "bare": "D F / 4: no shadowing, no 1 / (cos_i cos_o); for metal flakes",
    "ms": "with what is scattered more than once (Kulla and Conty)",
    "spectral": "one surface for all wavelengths, scaled as theory has it",
    "beckmann": "facets of Beckmann's distribution instead of GGX",
    "two_widths": "a width of its own for transmitted light",
    "mixed": "polarisations mixed between the faces of a plate, as renderers do",
    "media": "different media in front and behind, by their relative index",
    "retro": "turned around: shines back at the source",
    "back": "turned over: at the back of the sample instead of at its front",
}


def options_of(lobe: Any) -> list[str]:
    """The words for the options that a class of lobes has."""
    fields = lobe.__dataclass_fields__
    wrappers = {"retro": lobe.RETRO, "back": True}
    return [o for o, (f, _) in OPTIONS.items() if f in fields or wrappers.get(f)]


_TERM = re.compile(
    r"\s*(?:(?P<count>\d+)\s*\*\s*)?(?P<name>[a-z][a-z0-9_]*|[^()+*]*\.py)\s*"
    r"(?:\((?P<options>[^()]*)\))?\s*"
)


class ModelError(ValueError):
    """A model expression, parameter name, bound or tie that makes no sense."""


@dataclass(frozen=True)
class Term:
    """One lobe of an expression, by name or by its file, with the options behind it."""

    lobe: str
    options: tuple[str, ...]

    def __str__(self) -> str:
        return f"{self.lobe}({', '.join(self.options)})" if self.options else self.lobe


def parse(expression: str, known: tuple[str, ...]) -> tuple[Term, ...]:
    """Terms of an expression, repeated as often as their factors say.

    Raises `ModelError` that names the part that is wrong and the nearest known lobe.
    """
    terms: list[Term] = []
    for part in expression.split("+"):
        match = _TERM.fullmatch(part)
        if match is None:
            raise ModelError(
                f"model {expression!r}: {part.strip() or 'an empty term'!r} is no lobe; "
                "write for instance 'lambert + ggx' or 'lambert + 2*ggx(aniso)'"
            )
        name = match["name"]
        if name not in known and not name.endswith(".py"):
            near = difflib.get_close_matches(name, known, n=1)
            hint = f"did you mean {near[0]!r}?" if near else f"known: {', '.join(known)}"
            raise ModelError(f"model {expression!r}: there is no lobe {name!r}; {hint}")
        count = int(match["count"] or 1)
        if not 1 <= count <= 8:
            raise ModelError(f"model {expression!r}: {count} lobes {name!r}; use 1 to 8")
        options = tuple(o.strip() for o in (match["options"] or "").split(",") if o.strip())
        for option in options:
            if option not in OPTIONS:
                raise ModelError(
                    f"model {expression!r}: lobe {name!r} has no option {option!r}; "
                    f"options: {', '.join(OPTIONS)}"
                )
        terms += [Term(name, options)] * count
    return tuple(terms)


def canonical(terms: tuple[Term, ...]) -> str:
    """The expression in one spelling: equal neighbours counted, blanks normalised."""
    parts: list[str] = []
    i = 0
    while i < len(terms):
        j = i
        while j < len(terms) and terms[j] == terms[i]:
            j += 1
        parts.append(f"{j - i}*{terms[i]}" if j - i > 1 else str(terms[i]))
        i = j
    return " + ".join(parts)


def lobe_labels(names: tuple[str, ...]) -> tuple[str, ...]:
    """A name for each lobe: ``ggx`` if it is alone, else ``ggx1, ggx2`` in order."""
    seen: dict[str, int] = {}
    labels: list[str] = []
    for name in names:
        seen[name] = seen.get(name, 0) + 1
        labels.append(f"{name}{seen[name]}" if names.count(name) > 1 else name)
    return tuple(labels)
