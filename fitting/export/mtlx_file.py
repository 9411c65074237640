"""Elements of MaterialX documents."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence

import numpy as np

Value = float | bool | str | np.ndarray


def document() -> ET.Element:
    """An empty document whose colours are linear with the primaries of sRGB."""
    return ET.Element("materialx", version="1.39", colorspace="lin_rec709")


def add_node(
    root: ET.Element, category: str, name: str, kind: str, inputs: Mapping[str, Value]
) -> None:
    """A node with constant inputs; arrays of three are colours, of two vectors."""
    node = ET.SubElement(root, category, name=name, type=kind)
    for own, value in inputs.items():
        if isinstance(value, bool):
            said, text = "boolean", str(value).lower()
        elif isinstance(value, str):
            said, text = "string", value
        elif isinstance(value, np.ndarray) and value.ndim:
            said = {2: "vector2", 3: "color3"}[value.size]
            text = ", ".join(f"{v:.9g}" for v in value)
        else:
            said, text = "float", f"{float(value):.9g}"
        ET.SubElement(node, "input", name=own, type=said, value=text)


def connect(root: ET.Element, node: str, name: str, kind: str, source: str) -> None:
    """An input of a node that is the output of another one."""
    found = next(n for n in root if n.get("name") == node)
    ET.SubElement(found, "input", name=name, type=kind, nodename=source)


def text_of(root: ET.Element, comment: Sequence[str]) -> str:
    """The document as text, with lines of comment before it."""
    ET.indent(root, "  ")
    said = "\n".join(f"  {line}" for line in comment).replace("--", "- -")
    body = ET.tostring(root, encoding="unicode")
    return f'<?xml version="1.0"?>\n<!--\n{said}\n-->\n{body}\n'


def identifier(name: str) -> str:
    """A name as MaterialX allows it: letters, digits and underscores."""
    plain = re.sub(r"\W", "_", name, flags=re.ASCII)
    return plain if plain[:1].isalpha() else f"m_{plain}"
