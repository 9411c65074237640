"""From choices on the command line and in a job file to what the fit takes."""

from __future__ import annotations

import dataclasses
import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, get_args

from fitting.cli import assignments
from fitting.cli.failures import UsageError
from fitting.cli.fit_choices import Choices, ObjectiveChoice, WeightsChoice

_BOOLEAN = ("per-channel-shape", "robust", "cv", "colour", "json")
_NUMBERS = ("max-theta", "reciprocity")
_BY_PARAMETER = ("fix", "bounds", "tie", "material")
_NAMED = (*_BY_PARAMETER, "reader")
_TEXT = ("format", "output")


@dataclass(frozen=True)
class Job:
    """What is to be done. ``options`` are arguments of `FitOptions`."""

    models: tuple[str, ...] = ()
    options: dict[str, Any] = field(default_factory=dict)
    cross_validate: bool = True
    colour: bool = False
    output: Path | None = None
    json: bool = False
    format: str | None = None
    reader: dict[str, Any] = field(default_factory=dict)


def settle(choices: Choices) -> Job:
    """The job; raises `UsageError` that names the option and what it expects."""
    said: dict[str, Any] = _job_file(choices.config) if choices.config else {}
    for f in dataclasses.fields(choices):
        value = getattr(choices, f.name)
        key = f.name.replace("_", "-")
        if value is None or key == "config":
            continue
        if key in _NAMED:
            said[key] = said.get(key, {}) | assignments.of_lines(key, value)
        else:
            said[key] = value
    return _job(said)


def _job_file(path: Path) -> dict[str, Any]:
    try:
        raw = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise UsageError(f"--config {path}: {error.strerror or error}") from error
    except ValueError as error:
        raise UsageError(f"--config {path}: not TOML: {error}") from error
    known = [f.name.replace("_", "-") for f in dataclasses.fields(Choices)]
    out: dict[str, Any] = {}
    for written, value in raw.items():
        key = {"color": "colour"}.get(written, written.replace("_", "-"))
        if key.startswith("no-") and key[3:] in _BOOLEAN:
            key, value = key[3:], not _boolean(key, value)
        if key not in known or key == "config":
            raise UsageError(
                f"--config {path}: there is no option {written!r}"
                + assignments.nearest(key, known)
            )
        if key in _NAMED:
            value = assignments.of_toml(key, value)
        out[key] = value
    return out


def _job(said: Mapping[str, Any]) -> Job:
    options: dict[str, Any] = {}
    for key, value in said.items():
        if key in _BOOLEAN:
            _boolean(key, value)
        if key in _TEXT and not isinstance(value, str | Path):
            raise UsageError(f"--{key}: found {value!r}, expected text")
        if key in ("fix", "bounds", "tie", "material") or key in (
            "robust",
            "per-channel-shape",
        ):
            options[key.replace("-", "_")] = value
        elif key in _NUMBERS:
            options[key.replace("-", "_")] = _number(key, value)
        elif key == "objective":
            options[key] = _one_of(key, value, get_args(ObjectiveChoice))
        elif key == "weights":
            options[key] = _one_of(key, value, get_args(WeightsChoice))
        elif key == "noise":
            options[key] = noise_of(value)
        elif key == "energy":
            options[key] = "hard" if value == "hard" else _number(key, value)
        elif key == "starts":
            options[key] = _starts(value)
    if "max_theta" in options:
        options["max_theta_deg"] = options.pop("max_theta")
        if not 0 < options["max_theta_deg"] <= 90:
            raise UsageError(
                f"--max-theta {options['max_theta_deg']:g}: expected 0 to 90 degrees"
            )
    output = said.get("output")
    return Job(
        models=_models(said.get("model")),
        options=options,
        cross_validate=said.get("cv", True),
        colour=said.get("colour", False),
        output=None if output is None else Path(output),
        json=said.get("json", False),
        format=said.get("format"),
        reader=said.get("reader", {}),
    )


def _models(value: Any) -> tuple[str, ...]:
    if value is None:
        return ()
    listed = [value] if isinstance(value, str) else value
    if not isinstance(listed, list) or not all(isinstance(v, str) for v in listed):
        raise UsageError(f"--model: found {value!r}, expected text or a list of texts")
    return tuple(dict.fromkeys(listed))


def _boolean(key: str, value: Any) -> bool:
    if not isinstance(value, bool):
        raise UsageError(f"--{key}: found {value!r}, expected true or false")
    return value


def _number(key: str, value: Any) -> float:
    number = assignments.number(value)
    if not (math.isfinite(number) and number >= 0):
        expected = "a number, 0 or more" + (", or hard" if key == "energy" else "")
        raise UsageError(f"--{key}: found {value!r}, expected {expected}")
    return number


def _one_of(key: str, value: Any, known: tuple[str, ...]) -> str:
    if value not in known:
        raise UsageError(f"--{key}: found {value!r}, expected one of {', '.join(known)}")
    return value


def noise_of(value: Any) -> tuple[float, float]:
    parts = value.split(",") if isinstance(value, str) else value
    numbers = [assignments.number(p) for p in parts] if isinstance(parts, list) else []
    if len(numbers) != 2 or not all(math.isfinite(x) and x >= 0 for x in numbers):
        raise UsageError(
            f"--noise: found {value!r}, expected two numbers A,B, 0 or more: the relative "
            "and the absolute standard uncertainty"
        )
    if not any(numbers):
        raise UsageError("--noise 0,0: at least one of the two must be above 0")
    return numbers[0], numbers[1]


def _starts(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= 1000:
        raise UsageError(f"--starts: found {value!r}, expected a whole number, 1 to 1000")
    return value
