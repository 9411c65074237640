"""What the tests of reports look at: fits of the bundled sample."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from data_formats import Measurement, read
from fitting.comparison import Comparison, choose
from fitting.fitter import fit
from fitting.report import Reported, page
from fitting.result import FitResult
from fitting.sample import sample_path


@pytest.fixture(scope="session")
def data() -> Measurement:
    return read(sample_path())


@pytest.fixture(scope="session")
def other(data: Measurement) -> FitResult:
    return fit(data, "lambert", starts=1)


@pytest.fixture(scope="session")
def kept(data: Measurement, other: FitResult) -> FitResult:
    """The better of two models; one of its parameters is fixed."""
    second = fit(data, "lambert + ggx", starts=2, colour=True, fix={"ggx.f90": 0.6})
    best, reason = choose((other, second))
    assert best == 1
    return Comparison((other, second), best, reason).kept


@pytest.fixture(scope="session")
def coarse() -> Iterator[None]:
    """Few pixels and few nodes for each: what is tested does not depend on them."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("fitting.plots.sphere._PIXELS", 12)
        patch.setattr("fitting.plots.rendered._PER_PIXEL", 8)
        yield


@pytest.fixture(scope="session")
def html(kept: FitResult, other: FitResult, data: Measurement, coarse: None) -> str:
    """A report of several results with all figures, and without a script."""
    every = [
        Reported(kept, data, "", "a.fit.json"),
        Reported(other, data, "", "b.fit.json"),
    ]
    return page(every, viewer=False)


@pytest.fixture
def written(html: str, tmp_path: Path) -> Path:
    file = tmp_path / "a.report.html"
    file.write_text(html, encoding="utf-8")
    return file
