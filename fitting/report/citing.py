"""How to cite the models, the program and the data."""

from __future__ import annotations

import re
from pathlib import Path

from fitting.report.blocks import Block, Bullets, Words
from fitting.report.reported import Reported

_CITATION = re.compile(r"cit(e|ation)|reference|doi|publication|licen[cs]e", re.IGNORECASE)
_DIGITS_OF_SHA = 16


def blocks(about: Reported) -> list[Block]:
    """A sentence to copy, then the sources of the lobes and what the file says itself."""
    result = about.result
    out: list[Block] = [
        Words("A sentence for a paper:"),
        Words(_sentence(about)),
        Words("Sources of the lobes, whose formulas were fitted:"),
        Bullets(result.references or ["none stated"]),
    ]
    own = _of_the_file(about)
    if own:
        out += [Words("The file of the measurement says:"), Bullets(own)]
    return out


def _sentence(about: Reported) -> str:
    result, data = about.result, about.result.data
    files = ", ".join(Path(p).name for p in data.path.split(" + ") if p)
    of_file = f" ({files}, SHA-256 {data.sha256[:_DIGITS_OF_SHA]}...)" if files else ""
    with_what = f", measured with {data.instrument}," if data.instrument else ""
    program = result.versions.get("brdf-fitting", "of unknown version")
    return (
        f"“The model {result.model} was fitted to {data.rows_used} directions of "
        f"{about.name}{of_file}{with_what} with brdf-fitting {program}, minimising the "
        f"objective {result.settings.objective}; uncertainties are standard uncertainties "
        f"(k = 1, {result.uncertainty_method}).”"
    )


def _of_the_file(about: Reported) -> list[str]:
    if about.measurement is None:
        return []
    header = about.measurement.provenance.header
    return [f"{key}: {text}" for key, text in header.items() if _CITATION.search(key)]
