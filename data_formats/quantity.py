"""What a header says its values are: per steradian or factors, reflected or transmitted.

A reflectance or transmittance factor is `pi f`, 1 for the ideal diffuser. The names of
columns and fields such as `QUANTITY` or `MEAS_NAME` decide; where there is none, a line of
text does if no other line contradicts it. What stays open is asked in a note.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Literal, get_args

from data_formats.measurement import MeasurementError
from data_formats.provenance import one_line

Quantity = Literal["bsdf", "brdf", "btdf", "brf", "btf"]
Side = Literal["transmitted", "as-written"]

_MOST_CHARACTERS, _MOST_LINES = 2000, 1000


def _words(pattern: str) -> re.Pattern[str]:
    # "BRF" is no part of "BRDF", but "brf_450nm" and "BRFs" speak of it.
    return re.compile(rf"(?<![a-z])(?:{pattern})s?(?![a-z])", re.IGNORECASE)


_FACTOR = _words(r"BRF|(?:reflectance|radiance|transmittance)[ _-]{1,3}factor")
_PER_STERADIAN = _words(
    r"BRDF|BTDF|BSDF|distribution[ _-]{1,3}function|1/sr|sr\^?-1|per steradian"
)
_TRANSMITTED = _words(r"BTDF|transmittance|transmission|transmitted")
_REFLECTED = _words(r"BRDF|BRF|reflect\w*")
_UNCLEAR = _words(r"reflectance|transmittance")
# A line that states what the values are, not just mentions transmission.
_STATES_TRANSMITTED = _words(
    r"BTDF|bidirectional[ _-]{1,3}transmi\w*|transmittance[ _-]{1,3}factor"
    r"|transmi(?:ttance|ssion) (?:value|data|measurement|mode)"
)
# Lines about something else than the values, or that deny what they say.
_ASIDE = _words(
    r"not|no|reference|standard|calibrat\w*|panel|filter|grating|convert\w*|hemispher\w*"
)
_ABOUT_VALUES = frozenset(
    [
        *["quantity", "unit", "units", "value", "values", "valueunit", "valueunits"],
        *["measname", "meastype", "measurement", "measurementtype", "datatype"],
        *["scattertype", "mode", "side"],
    ]
)
# Names of things, which may contain any word.
_NAMES = re.compile(
    r"(?:sample|file|lab|system|instrument|operator|path)(?!_?comment)", re.IGNORECASE
)


@dataclass(frozen=True)
class Reading:
    """How to read values and `theta_r`: the words that say so, `""` where none does.

    **Arguments:**

    - `factor`: the values are `pi f`.
    - `transmitted`: every row is transmitted light.
    - `perhaps_factor`, `perhaps_transmitted`: words that leave it open.
    - `asked`: whether it was the user who said that every row is transmitted.
    """

    factor: str = ""
    transmitted: str = ""
    perhaps_factor: str = ""
    perhaps_transmitted: str = ""
    asked: bool = False


def reading(
    header: Mapping[str, str],
    names: Sequence[str],
    *,
    quantity: Quantity | None = None,
    side: Side | None = None,
) -> Reading:
    """What a header says, and what the user says instead.

    **Arguments:**

    - `header`: fields of the file; lines without a key under `preamble` or `comments`.
    - `names`: of the columns of values.
    - `quantity`: `"brdf"`, `"btdf"`, `"bsdf"` in 1/sr, `"brf"` or `"btf"`, the reflectance
        or transmittance factors; `None`: as the header says, else in 1/sr.
    - `side`: `"transmitted"`: every row is transmitted light; `"as-written"`: `theta_r` is
        taken as it is; `None`: as `quantity` or else the header says.

    **Raises:** `MeasurementError` if an option is none of these.
    """
    for name, option, known in (("quantity", quantity, Quantity), ("side", side, Side)):
        if option is not None and option not in get_args(known):
            expected = ", ".join(map(repr, get_args(known)))
            raise MeasurementError(f"{name} is {option!r}; expected one of {expected}")
    stated = _stated(header, names)
    said = f"quantity={quantity!r}"
    factor, unclear = stated.factor, stated.perhaps_factor
    if quantity is not None:
        factor, unclear = said if quantity in ("brf", "btf") else "", ""
    if side is not None:
        transmitted = f"side={side!r}" if side == "transmitted" else ""
        return Reading(factor, transmitted, unclear, "", True)
    if quantity is not None:
        return Reading(factor, said if quantity in ("btdf", "btf") else "", "", "", True)
    return stated


def says_factor(key: str, text: str) -> bool:
    """Whether a header field says that the values are factors."""
    return _is_about_values(key) and _FACTOR.search(text[:_MOST_CHARACTERS]) is not None


def is_factor(name: str) -> bool:
    """Whether a band's name is that of a factor: `brf`."""
    return _FACTOR.fullmatch(name) is not None


def _is_about_values(key: str) -> bool:
    return re.sub(r"[\s_-]", "", key).lower() in _ABOUT_VALUES


def _stated(header: Mapping[str, str], names: Sequence[str]) -> Reading:
    decisive = [name[:_MOST_CHARACTERS] for name in names]
    lines: list[str] = []
    mentioned: list[str] = []
    for key, text in islice(header.items(), _MOST_LINES):
        if key in ("preamble", "comments"):
            lines += map(_without_paths, text.split("\n", _MOST_LINES)[:_MOST_LINES])
            continue
        line = _without_paths(f"{key} {text}")
        if _is_about_values(key):
            decisive.append(line)
        elif _NAMES.match(key):
            mentioned.append(line)
        else:
            lines.append(line)
    factor, perhaps_factor = _decide(_FACTOR, _FACTOR, _PER_STERADIAN, decisive, lines)
    transmitted, perhaps_transmitted = _decide(
        _TRANSMITTED, _STATES_TRANSMITTED, _REFLECTED, decisive, lines
    )
    if not factor:
        unclear = "" if _first(_PER_STERADIAN, decisive) else _first(_UNCLEAR, decisive)
        perhaps_factor = perhaps_factor or unclear or _first(_FACTOR, mentioned)
    return Reading(factor, transmitted, perhaps_factor, perhaps_transmitted)


def _decide(
    word: re.Pattern[str],
    statement: re.Pattern[str],
    opposite: re.Pattern[str],
    decisive: Sequence[str],
    lines: Sequence[str],
) -> tuple[str, str]:
    """The text that says `word`, and one that only perhaps does; each may be `""`."""
    said = _first(word, decisive)
    denied = _first(opposite, decisive)
    if said or denied:
        if said and denied:
            return "", said
        return said, ("" if said else _first(statement, lines))
    clear = [line for line in lines if not _ASIDE.search(line)]
    stated = _first(statement, clear)
    if stated and not _first(opposite, lines):
        return stated, ""
    return "", stated or _first(word, lines)


def _first(pattern: re.Pattern[str], texts: Sequence[str]) -> str:
    """The first text with the pattern, short enough for a note."""
    found = next((t for t in texts if pattern.search(t)), "")
    return one_line(found)[:60]


def _without_paths(line: str) -> str:
    """A line without the names of files and folders in it."""
    return " ".join(
        word
        for word in line[:_MOST_CHARACTERS].split()
        if "\\" not in word and word.count("/") < 2
    )
