"""One table of all measured numbers at the end of a run, also under pytest-xdist."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest

_KEY = "benchmark"


@pytest.fixture(autouse=True)
def nothing_from_a_cache() -> Iterator[None]:
    """What is timed and analysed is what the compiler makes now."""
    import jax

    jax.config.update("jax_enable_compilation_cache", False)
    yield
    jax.config.update("jax_enable_compilation_cache", True)


@pytest.fixture
def line(record_property) -> Callable[[str], None]:
    """Add a line to the table."""
    return lambda text: record_property(_KEY, text)


def pytest_terminal_summary(terminalreporter) -> None:
    """Print the lines; properties of a test travel with its report from the workers."""
    reports = [
        report
        for outcome in ("passed", "failed")
        for report in terminalreporter.getreports(outcome)
        if getattr(report, "when", "") == "call"
    ]
    lines = [text for r in reports for key, text in r.user_properties if key == _KEY]
    if lines:
        terminalreporter.section("benchmarks")
        for text in lines:
            terminalreporter.write_line(text)
