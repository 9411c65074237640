"""Trees of Mitsuba's plugins as XML and as JSON for `mi.load_dict`."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from data_formats import Channel

# nm; spectra of Mitsuba are zero outside of their range.
_ENDS = (360.0, 830.0)
_VERSION = "3.0.0"


@dataclass(frozen=True)
class Colour:
    """Values ``(c,)`` of a plugin's colour; ``index`` for refractive indices, which
    Mitsuba takes as they are."""

    values: np.ndarray
    index: bool = False


Tree = Mapping[str, Any]


def as_json(tree: Tree, channels: Sequence[Channel], comment: Sequence[str]) -> str:
    """``{"comment": [...], "material": {...}}``, the latter for `mi.load_dict`."""
    plain = {"comment": list(comment), "material": _plain(tree, channels)}
    return json.dumps(plain, indent=1, allow_nan=False) + "\n"


def as_xml(tree: Tree, channels: Sequence[Channel], comment: Sequence[str]) -> str:
    """A document whose root is the ``bsdf``, for `mi.load_file` and ``<include>``."""
    root = _element(tree, channels)
    root.set("version", _VERSION)
    ET.indent(root, " ")
    # A comment may not hold two hyphens.
    said = "\n".join(f"  {line}" for line in comment).replace("--", "- -")
    return f"<!--\n{said}\n-->\n{ET.tostring(root, encoding='unicode')}\n"


def _plain(tree: Tree, channels: Sequence[Channel]) -> dict[str, Any]:
    out: dict[str, Any] = {}
    for name, value in tree.items():
        if isinstance(value, Colour):
            out[name] = _plain_colour(value, channels)
        elif isinstance(value, Mapping):
            out[name] = _plain(value, channels)
        else:
            out[name] = value
    return out


def _plain_colour(colour: Colour, channels: Sequence[Channel]) -> dict[str, Any]:
    if _spectral(channels):
        pairs = [list(p) for p in _spectrum(colour.values, channels)]
        return {"type": "spectrum", "value": pairs}
    values = [_rounded(v) for v in colour.values]
    if colour.index or max(values) <= 1.0:
        return {"type": "rgb", "value": values}
    return {"type": "srgb", "color": values, "unbounded": True}


def _element(tree: Tree, channels: Sequence[Channel]) -> ET.Element:
    out = ET.Element("bsdf", type=str(tree["type"]))
    for name, value in tree.items():
        if name == "type":
            continue
        if isinstance(value, Colour):
            _add_colour(out, name, value, channels)
        elif isinstance(value, Mapping):
            child = _element(value, channels)
            child.set("name", name)
            out.append(child)
        else:
            kind = {bool: "boolean", str: "string"}.get(type(value), "float")
            text = str(value).lower() if isinstance(value, bool) else str(value)
            ET.SubElement(out, kind, name=name, value=text)
    return out


def _add_colour(
    parent: ET.Element, name: str, colour: Colour, channels: Sequence[Channel]
) -> None:
    if _spectral(channels):
        pairs = _spectrum(colour.values, channels)
        text = ", ".join(f"{w:g}:{v:.9g}" for w, v in pairs)
        ET.SubElement(parent, "spectrum", name=name, value=text)
        return
    text = " ".join(f"{v:.9g}" for v in colour.values)
    if colour.index or np.max(colour.values) <= 1.0:
        ET.SubElement(parent, "rgb", name=name, value=text)
        return
    texture = ET.SubElement(parent, "texture", type="srgb", name=name)
    ET.SubElement(texture, "rgb", name="color", value=text)
    ET.SubElement(texture, "boolean", name="unbounded", value="true")


def _spectral(channels: Sequence[Channel]) -> bool:
    return all(c.wavelength_nm is not None for c in channels)


def _spectrum(values: np.ndarray, channels: Sequence[Channel]) -> list[tuple[float, float]]:
    """Ascending wavelengths and values, the first and last value going on outside."""
    at = sorted(
        (float(c.wavelength_nm or 0.0), _rounded(v))
        for c, v in zip(channels, values, strict=True)
    )
    first, last = min(_ENDS[0], at[0][0] - 1.0), max(_ENDS[1], at[-1][0] + 1.0)
    return [(first, at[0][1]), *at, (last, at[-1][1])]


def _rounded(value: float) -> float:
    return float(f"{value:.9g}")
