"""Formats that are recognised by content, and refused by name instead of misread."""

from __future__ import annotations

import re

# (what it is, a pattern that its first bytes match)
_KNOWN: tuple[tuple[str, re.Pattern[bytes]], ...] = tuple(
    (name, re.compile(pattern, re.MULTILINE))
    for name, pattern in (
        ("a tensor_file container that is neither RGL's nor KAIST's", rb"\Atensor_file\0"),
        ("a Fourier BSDF (SCATFUN)", rb"\ASCATFUN"),
        ("an ALTA function file (#FUNC)", rb"^#FUNC\b"),
        ("a LightTools BSDF file (ScatterRadial)", rb"^[ \t]*ScatterRadial[ \t]+\d"),
        ("an RPC Photonics table (!!BSDF Data)", rb"^!!BSDF Data"),
        (
            "a Disney BRDF Explorer function (GLSL, no measurement)",
            rb"\A\s*(?:analytic\b|::begin)",
        ),
        ("an OpenEXR image", rb"\A\x76\x2f\x31\x01"),
        ("a ZIP archive or .xlsx workbook: export it as CSV", rb"\APK\x03\x04"),
        ("an Excel workbook: export it as CSV", rb"\A\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"),
    )
)


def recognise(head: bytes) -> str | None:
    """What a file is, if it is one of these formats; `head` is its first 64 kB."""
    return next((name for name, pattern in _KNOWN if pattern.search(head)), None)
