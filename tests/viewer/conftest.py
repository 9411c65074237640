"""What the tests of the viewer look at: fits of the bundled sample."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from opened_pages import Open, Opened

from data_formats import Measurement, read
from fitting import fit
from fitting.result import FitResult
from fitting.sample import sample_path


@pytest.fixture(scope="session")
def paint() -> Measurement:
    return read(sample_path())


@pytest.fixture(scope="session")
def glossy(paint: Measurement) -> FitResult:
    return fit(paint, "lambert + ggx", starts=2)


@pytest.fixture(scope="session")
def matt(paint: Measurement) -> FitResult:
    return fit(paint, "oren_nayar", starts=1)


@pytest.fixture(scope="module")
def opened(browser: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Open]:
    """Opens HTML from a file, as a user does; any other request is refused and noted."""
    contexts = []

    def show(html: str, **options: Any) -> Opened:
        file = tmp_path_factory.mktemp("page") / "page.html"
        file.write_text(html, "utf-8")
        context = browser.new_context(**options)
        contexts.append(context)
        out = Opened(context.new_page())

        def listen(text: str) -> None:
            # A software renderer remarks on its own speed when a screenshot is taken.
            if "GL Driver Message (OpenGL, Performance" not in text:
                out.said.append(text)

        def route(request: Any) -> None:
            out.asked.append(request.request.url)
            own = request.request.url == file.as_uri()
            request.continue_() if own else request.abort()

        out.page.route("**/*", route)
        out.page.on("console", lambda message: listen(message.text))
        out.page.on("pageerror", lambda error: out.said.append(str(error)))
        out.page.goto(file.as_uri())
        return out

    yield show
    for context in contexts:
        context.close()
