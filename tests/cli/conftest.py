"""One fit that the tests of the command line share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest
from running import Outcome, Run, invoke

from fitting.comparison import Comparison


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Run:
    """Runs a command in an empty folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")
    return invoke


@dataclass(frozen=True)
class Fitted:
    """What `brdf fit` of the sample with two models printed, returned and wrote."""

    outcome: Outcome
    file: Path
    comparison: Comparison
    run: Callable[..., Comparison]


@pytest.fixture(scope="session")
def fitted(tmp_path_factory: pytest.TempPathFactory) -> Fitted:
    """The one real fit of these tests, since compiling takes long."""
    from fitting.cli import fit_run

    seen = []
    real = fit_run.run

    def spy(*args):
        seen.append(real(*args))
        return seen[-1]

    folder = tmp_path_factory.mktemp("fitted")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.setenv("COLUMNS", "100")
        patch.setattr(fit_run, "run", spy)
        outcome = invoke("fit", "-m", "lambert", "-m", "lambert+ggx")
    assert outcome.code == 0, outcome.err
    return Fitted(outcome, folder / "two_lobe_paint.fit.json", seen[0], real)


@pytest.fixture
def done(fitted: Fitted, monkeypatch: pytest.MonkeyPatch) -> Fitted:
    """Makes `brdf fit` return the shared fit at once."""
    from fitting.cli import fit_run

    monkeypatch.setattr(fit_run, "run", lambda *_: fitted.comparison)
    return fitted
