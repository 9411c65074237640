"""NAME=VALUE, NAME=LOW:HIGH and NAME=FACTOR*OTHER, from a command line or from TOML."""

from __future__ import annotations

import difflib
import math
from collections.abc import Sequence
from typing import Any

from fitting.cli.failures import UsageError

_FORMS = {
    "fix": "NAME=VALUE, a number or one per channel with commas",
    "bounds": "NAME=LOW:HIGH, where an empty end is infinite",
    "tie": "NAME=FACTOR*OTHER or NAME=OTHER",
    "reader": "OPTION=VALUE",
    "material": "LOBE=MATERIAL, such as ggx=Au, or LOBE=FILE",
}


def of_lines(key: str, lines: Sequence[str]) -> dict[str, Any]:
    """Values by name of a repeated option; the last one of a name counts."""
    out: dict[str, Any] = {}
    for line in lines:
        name, equals, text = (part.strip() for part in line.partition("="))
        if not (name and equals and text):
            raise UsageError(f"--{key} {line!r}: expected {_FORMS[key]}")
        out[name] = _value(key, name, text)
    return out


def of_toml(key: str, value: Any) -> dict[str, Any]:
    """The same from a job file: a table by name, or a list of texts as on the command
    line."""
    if isinstance(value, list) and all(isinstance(v, str) for v in value):
        return of_lines(key, value)
    if not isinstance(value, dict):
        raise UsageError(f"--{key}: found {value!r}, expected a table or {_FORMS[key]}")
    return {name: _value(key, name, v) for name, v in _flat(value).items()}


def number(value: Any) -> float:
    """The number, or NaN if it is none."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        return math.nan
    try:
        return float(value)
    except ValueError:
        return math.nan


def nearest(name: str, known: Sequence[str]) -> str:
    """``; did you mean ...?`` or the list of what there is."""
    near = difflib.get_close_matches(name, known, n=1)
    return f"; did you mean {near[0]!r}?" if near else f"; known: {', '.join(known)}"


def _flat(table: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    """TOML reads the unquoted key ``ggx.f90`` as a table in a table."""
    out: dict[str, Any] = {}
    for name, value in table.items():
        if isinstance(value, dict):
            out |= _flat(value, f"{prefix}{name}.")
        else:
            out[f"{prefix}{name}"] = value
    return out


def _value(key: str, name: str, value: Any) -> Any:
    if key == "fix":
        return _fixed(name, value)
    if key == "bounds":
        return _interval(name, value)
    if key == "reader":
        return _plain(value)
    if not isinstance(value, str):
        raise UsageError(f"--{key} {name}={value!r}: expected {_FORMS[key]}")
    return value


def _fixed(name: str, value: Any) -> Any:
    parts = value.split(",") if isinstance(value, str) else value
    numbers = [number(p) for p in (parts if isinstance(parts, list) else [parts])]
    if not numbers or not all(map(math.isfinite, numbers)):
        raise UsageError(f"--fix {name}={value}: expected {_FORMS['fix']}")
    if len(numbers) == 1:
        return numbers[0]
    import numpy as np

    return np.asarray(numbers)


def _interval(name: str, value: Any) -> tuple[float, float]:
    parts = value.split(":") if isinstance(value, str) else value
    ends = list(parts) if isinstance(parts, list) else []
    if len(ends) == 2:
        low = -math.inf if str(ends[0]).strip() == "" else number(ends[0])
        high = math.inf if str(ends[1]).strip() == "" else number(ends[1])
        if low < high:
            return low, high
    raise UsageError(
        f"--bounds {name}={value}: expected {_FORMS['bounds']}, with LOW below HIGH"
    )


def _plain(value: Any) -> Any:
    """``true``, a number or text."""
    if not isinstance(value, str):
        return value
    if value.lower() in ("true", "false"):
        return value.lower() == "true"
    found = number(value)
    return value if math.isnan(found) else found
