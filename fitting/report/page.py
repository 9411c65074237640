"""From sections to one HTML file."""

from __future__ import annotations

import base64
import hashlib
import re
from collections.abc import Callable, Sequence
from importlib.metadata import version
from importlib.resources import files

from fitting.report.blocks import Embedded
from fitting.report.reported import Reported

_SCRIPT = re.compile(r"<script\b[^>]*>(.*?)</script>", re.DOTALL | re.IGNORECASE)
_UNIT, _NO_BREAK = re.compile(r"(?<=\d) (?=%|deg\b|nm\b|per sr)"), "\N{NO-BREAK SPACE}"
_CODE = re.compile(r"`([^`]+)`")
_TEMPLATES = ("page.html", "blocks.html")


class ReportMissing(ImportError):
    """jinja2 is not installed."""


def require() -> None:
    """Raises `ReportMissing` without jinja2, in a sentence that says what to do."""
    try:
        import jinja2  # noqa: F401
    except ImportError as error:
        raise ReportMissing(
            "reports need jinja2, which is not installed; install the extra `report`: "
            "pip install 'brdf-fitting[report]'"
        ) from error


def page(
    every: Sequence[Reported],
    *,
    viewer: bool = True,
    progress: Callable[[str], None] = lambda _: None,
) -> str:
    """The report of a result, and of others to compare with, as HTML.

    ``viewer`` adds the surface to be turned and lit, which is the only script there is;
    ``progress`` is called with the name of every figure that is drawn. Nothing is loaded
    from anywhere, and the page forbids it itself. Raises `ReportMissing`.
    """
    require()
    from jinja2 import DictLoader, Environment, StrictUndefined

    from fitting.report.sections import heading, sections

    folder = files("fitting.report") / "templates"
    texts = {name: (folder / name).read_text("utf-8") for name in _TEMPLATES}
    environment = Environment(
        loader=DictLoader(texts), autoescape=True, undefined=StrictUndefined,
        trim_blocks=True, lstrip_blocks=True, finalize=_unbroken,
    )  # fmt: skip
    environment.filters["code"] = _with_code
    title, subtitle = heading(every[0])
    parts = sections(every, viewer, progress)
    embedded = [b.html for s in parts for b in s.blocks if isinstance(b, Embedded)]
    return environment.get_template("page.html").render(
        title=title,
        subtitle=subtitle,
        sections=parts,
        style=(folder / "style.css").read_text("utf-8"),
        policy=policy("".join(embedded)),
        program=f"brdf-fitting {version('brdf-fitting')}",
        source=every[0].file,
    )


def _unbroken(value: object) -> object:
    """Text with its numbers and their units on one line; what is escaped stays as it is."""
    return _UNIT.sub(_NO_BREAK, value) if type(value) is str else value


def _with_code(text: str) -> str:
    """Escaped, and what is between backticks as code."""
    from markupsafe import Markup, escape

    return Markup(_CODE.sub(r"<code>\1</code>", str(escape(_unbroken(text)))))


def policy(embedded: str) -> str:
    """The page's own Content-Security-Policy: no network, no scripts but those named."""
    scripts = " ".join(f"'sha256-{_digest(text)}'" for text in _SCRIPT.findall(embedded))
    return (
        "default-src 'none'; img-src data: blob:; style-src 'unsafe-inline'; "
        f"script-src {scripts or chr(39) + 'none' + chr(39)}; base-uri 'none'; "
        "form-action 'none'"
    )


def _digest(text: str) -> str:
    return base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
