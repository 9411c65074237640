"""Running commands in the process of the tests."""

from __future__ import annotations

import contextlib
import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from fitting.cli import main


@dataclass(frozen=True)
class Outcome:
    code: int
    out: str
    err: str


Run = Callable[..., Outcome]


def invoke(*argv: object) -> Outcome:
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = main([str(a) for a in argv])
    return Outcome(code, out.getvalue(), err.getvalue())


def one_sentence(text: str) -> bool:
    """Whether stderr holds one line of `brdf: ...` and no traceback."""
    lines = [line for line in text.splitlines() if line.startswith("brdf: ")]
    return len(lines) == 1 and "Traceback" not in text and "internal error" not in text


def refuse(run: Run, code: int, *argv: object, says: Sequence[str]) -> None:
    outcome = run(*argv)
    assert outcome.code == code, outcome.err
    assert one_sentence(outcome.err), outcome.err
    for word in says:
        assert word in outcome.err
    assert outcome.out == ""
    assert not list(Path.cwd().glob("*.fit.json"))
