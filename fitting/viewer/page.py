"""The viewer as a part of a page, and as a page of its own that opens from a disk."""

from __future__ import annotations

import base64
import hashlib
import html
import json
import os
import tempfile
from collections.abc import Sequence
from pathlib import Path

from data_formats import Measurement
from fitting.result import FitResult
from fitting.viewer import assets
from fitting.viewer.content import content


def fragment(
    results: Sequence[FitResult],
    measurements: Sequence[Measurement | None],
    names: Sequence[str] | None = None,
) -> str:
    """``<style>``, ``<section id="viewer">`` and ``<script>``: one viewer for several fits.

    ``measurements`` are the data of each fit, or None where they are not at hand; ``names``
    head the fits, else the names of the fitted files do. Nothing is loaded from anywhere.
    The page around it may have a content security policy: see `policy_of`.

    Raises `TranslationError` for a model that graphics hardware cannot evaluate.
    """
    style, section, script = _parts(results, measurements, names)
    return f'<style>{style}</style>\n{section}\n<script type="module">{script}</script>\n'


def page(
    results: Sequence[FitResult],
    measurements: Sequence[Measurement | None],
    names: Sequence[str] | None = None,
) -> str:
    """A page with nothing but the viewer, which may load nothing and call nobody.

    Arguments and errors as in `fragment`.
    """
    style, section, script = _parts(results, measurements, names)
    title = html.escape(", ".join(_names(results, names)))
    policy = (
        f"{policy_of(style, script)}; img-src data:; base-uri 'none'; form-action 'none'"
    )
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<link rel="icon" href="data:,">
<title>{title} - BRDF viewer</title>
<style>{style}</style>
</head>
<body class="viewer-page">
<main>
{section}
</main>
<script type="module">{script}</script>
</body>
</html>
"""


def policy_of(style: str, script: str) -> str:
    """The content security policy under which exactly this style and script may be."""
    return (
        f"default-src 'none'; style-src '{_digest(style)}'; script-src '{_digest(script)}'"
    )


def write(text: str, path: Path) -> None:
    """Write a page beside the target and rename it, so that no half file is left."""
    handle, beside = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.write(text)
        os.chmod(beside, 0o666 & ~_umask())
        os.replace(beside, path)
    except BaseException:
        Path(beside).unlink(missing_ok=True)
        raise


def _parts(
    results: Sequence[FitResult],
    measurements: Sequence[Measurement | None],
    names: Sequence[str] | None,
) -> tuple[str, str, str]:
    """Style, section with the data, and script."""
    headings = _names(results, names)
    fits = [content(*one) for one in zip(results, measurements, headings, strict=True)]
    data = json.dumps(
        {"fits": fits, "glsl": assets.shaders()}, allow_nan=False, separators=(",", ":")
    )
    # The only sequence that could end the element, or begin a comment in it.
    data = data.replace("<", "\\u003c")
    section = assets.text("viewer.html").replace("@DATA@", data)
    return assets.text("viewer.css"), section, assets.script()


def _names(results: Sequence[FitResult], names: Sequence[str] | None) -> list[str]:
    if names is not None:
        return list(names)
    found = [Path(r.data.path.split(" + ")[0]).stem or r.data.sample for r in results]
    return [name or r.model for name, r in zip(found, results, strict=True)]


def _digest(text: str) -> str:
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()


def _umask() -> int:
    current = os.umask(0)
    os.umask(current)
    return current
