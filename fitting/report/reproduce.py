"""The command that makes the same fit again."""

from __future__ import annotations

import shlex
from collections.abc import Sequence

from fitting.result import GIVEN_WEIGHTS, FitResult


def command(result: FitResult) -> str:
    """``brdf fit FILE -m MODEL ...``, with every setting that is not the default.

    Values keep all their digits. Materials are among what is fixed, by their index.
    """
    s = result.settings
    words = ["brdf", "fit", *filter(None, result.data.path.split(" + "))]
    words += ["-m", result.model, "--objective", s.objective]
    if s.weights not in ("solid-angle", GIVEN_WEIGHTS):
        words += ["--weights", s.weights]
    words += ["--max-theta", _digits(s.max_theta_deg)]
    words += ["--robust"] if s.robust else []
    words += ["--noise", _list(s.noise)] if s.noise else []
    words += ["--per-channel-shape"] if s.per_channel_shape else []
    words += ["--starts", str(s.starts)]
    words += ["--energy", s.energy if isinstance(s.energy, str) else _digits(s.energy)]
    words += ["--reciprocity", _digits(s.reciprocity)]
    for name, value in s.fix.items():
        words += ["--fix", f"{name}={_list(value)}"]
    for name, (low, high) in s.bounds.items():
        words += ["--bounds", f"{name}={_end(low)}:{_end(high)}"]
    for name, text in s.tie.items():
        words += ["--tie", f"{name}={text}"]
    words += ["--no-cv"] if result.cross_validation is None else []
    words += ["--colour"] if result.colour is not None else []
    return shlex.join(words)


def what_is_missing(result: FitResult) -> list[str]:
    """What the command cannot repeat, in sentences."""
    out = [
        "if the file was read with options (--reader, --format), give them again: the "
        "result does not keep them"
    ]
    if result.settings.weights == GIVEN_WEIGHTS:
        out.append("the weights were given row by row from Python, and are not kept")
    if result.data.format.startswith("values of the fitted "):
        out.append("the data are values of another fit, not a file")
    return out


def _digits(value: float) -> str:
    return repr(float(value)).removesuffix(".0")


def _list(values: Sequence[float]) -> str:
    return ",".join(map(_digits, values))


def _end(value: float | None) -> str:
    return "" if value is None else _digits(value)
