"""The command ``brdf``: one file per command, loaded when it is called.

Exit codes: 0 good, 1 the fit did not converge (or `brdf doctor` found a problem), 2 usage,
3 a file that cannot be read or written, 70 a bug, 130 interrupted.
"""

from __future__ import annotations

import contextlib
import gc
import os
import sys
import warnings
from collections.abc import Sequence

__all__ = ["main"]


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command line, without the program's name, and return the exit code."""
    from fitting.cli import failures

    tokens = list(sys.argv[1:] if argv is None else argv)
    debug = "--debug" in tokens
    if argv is None:
        _prepare_process(debug)
    try:
        code = _run(tokens)
        sys.stdout.flush()
        return code
    except KeyboardInterrupt:
        print("brdf: interrupted", file=sys.stderr)
        if argv is None:
            _leave_at_once(failures.INTERRUPTED)
        return failures.INTERRUPTED
    except (BrokenPipeError, SystemExit):
        # The reader of a pipe, such as `head`, has seen enough; rich turns the former into
        # the latter.
        if argv is None:
            _leave_at_once(failures.GOOD)
        return failures.GOOD
    except Exception as error:  # The outermost edge: people get a sentence.
        code = failures.report(error, debug)
        if argv is None and not debug:
            # Not waiting for what is still computed or compiled in the background.
            with contextlib.suppress(BrokenPipeError):
                sys.stdout.flush()
            _leave_at_once(code)
        return code


def _run(tokens: list[str]) -> int:
    from fitting.cli.application import application

    code = application()(
        tokens, exit_on_error=False, print_error=False, result_action="return_value"
    )
    return code if isinstance(code, int) else 0


def _leave_at_once(code: int) -> None:
    """End the process without tearing down the interpreter.

    Threads of XLA's compiler may still run, and crash if Python goes away below them; the
    buffer of a closed pipe cannot be flushed.
    """
    sys.stderr.flush()
    os._exit(code)


def _prepare_process(debug: bool) -> None:
    """What concerns the whole process, and therefore is not done for callers of `main`."""
    # Imports make a million objects that stay: looking through them takes a tenth of a
    # second of every command.
    gc.set_threshold(100_000, 20, 20)
    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure is not None:
            # A terminal that cannot show a character gets another one, not a traceback.
            reconfigure(errors="replace")
    if not debug and not sys.warnoptions:
        # Warnings of libraries are for programmers; findings are in results and notes.
        warnings.simplefilter("ignore")
