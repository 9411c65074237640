"""The bar with the time that remains."""

from __future__ import annotations

import io

from rich.console import Console

from fitting.cli.work import Work


def test_time_remains_is_known_when_steps_take_minutes():
    """Two steps of 100 s for a tenth each: 800 s remain."""
    now, out = [0.0], io.StringIO()
    console = Console(file=out, force_terminal=True, width=80, get_time=lambda: now[0])
    with Work(console, 10, quiet=False) as work:
        for step in range(3):
            work.at(f"step {step}", step, 0)
            now[0] += 100.0
    assert "0:13:20" in out.getvalue()


def test_elsewhere_a_line_per_subject():
    out = io.StringIO()
    with Work(Console(file=out), 3, quiet=False) as work:
        work.at("one: fit", 0, 0)
        work.at("one: errors", 1, 0)
        work.at("two: fit", 2, 0)
    assert out.getvalue().split() == ["one", "two"]
