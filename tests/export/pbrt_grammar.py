"""The grammar of pbrt-v4's files, as far as materials go, after its documentation.

https://pbrt.org/fileformat-v4: a directive is a word followed by quoted strings; then a
list of ``"type name"`` with a value or values in brackets.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

_TOKEN = re.compile(r'"[^"\n]*"|\[|\]|#[^\n]*|[^\s\[\]"#]+')
COLOUR = ("rgb", "spectrum", "texture")
FLOAT = ("float", "texture")
ROUGH = {"roughness": FLOAT, "uroughness": FLOAT, "vroughness": FLOAT}
# Parameters of each material with the types that they may have.
MATERIALS: dict[str, dict[str, tuple[str, ...]]] = {
    "diffuse": {"reflectance": COLOUR},
    "diffusetransmission": {
        "reflectance": COLOUR, "transmittance": COLOUR, "scale": ("float",),
    },
    "conductor": {
        "eta": COLOUR, "k": COLOUR, "reflectance": COLOUR, **ROUGH,
        "remaproughness": ("bool",),
    },
    "coateddiffuse": {
        "reflectance": COLOUR, "eta": (*FLOAT, "spectrum"), **ROUGH,
        "remaproughness": ("bool",), "thickness": FLOAT, "g": FLOAT, "albedo": COLOUR,
        "maxdepth": ("integer",), "nsamples": ("integer",),
    },
    "mix": {"materials": ("string",), "amount": FLOAT},
}  # fmt: skip


@dataclass
class Material:
    """A named material: ``type`` and its parameters, each with its type and values."""

    kind: str
    parameters: dict[str, tuple[str, list]] = field(default_factory=dict)


def parse(text: str) -> dict[str, Material]:
    """The named materials of a file in order. Raises ``ValueError``."""
    tokens = [t for t in _TOKEN.findall(text) if not t.startswith("#")]
    out: dict[str, Material] = {}
    at = 0

    def string() -> str:
        nonlocal at
        token = tokens[at]
        if not (len(token) > 1 and token[0] == token[-1] == '"'):
            raise ValueError(f"expected a string, found {token}")
        at += 1
        return token[1:-1]

    while at < len(tokens):
        directive = tokens[at]
        at += 1
        if directive != "MakeNamedMaterial":
            raise ValueError(f"unknown directive {directive}")
        name = string()
        if name in out:
            raise ValueError(f"{name} is defined twice")
        found: dict[str, tuple[str, list]] = {}
        while at < len(tokens) and tokens[at].startswith('"'):
            kind, _, own = string().partition(" ")
            if tokens[at] == "[":
                end = tokens.index("]", at)
                raw, at = tokens[at + 1 : end], end + 1
            else:
                raw, at = [tokens[at]], at + 1
            if own in found:
                raise ValueError(f"{name}: {own} is given twice")
            found[own] = (kind, [_value(kind, r) for r in raw])
        material = Material(found.pop("type")[1][0], found)
        _check(name, material, out)
        out[name] = material
    return out


def _value(kind: str, raw: str):
    if kind == "string":
        return raw.strip('"')
    if kind == "bool":
        return {"true": True, "false": False}[raw]
    if kind == "integer":
        return int(raw)
    return float(raw)


def _check(name: str, material: Material, defined: dict[str, Material]) -> None:
    known = MATERIALS[material.kind]
    for own, (kind, values) in material.parameters.items():
        if kind not in known[own]:
            raise ValueError(f"{name}: {own} is a {kind}; expected {known[own]}")
        counts = {"rgb": 3, "float": 1, "bool": 1, "integer": 1, "string": 2}
        if kind in counts and len(values) != counts[kind]:
            raise ValueError(f"{name}: {own} has {len(values)} values")
        if kind == "spectrum":
            nm = values[::2]
            if len(values) % 2 or nm != sorted(set(nm)):
                raise ValueError(f"{name}: {own} is no list of ascending wavelengths")
        albedo = own in ("reflectance", "transmittance") and kind == "rgb"
        # RGBAlbedoSpectrum refuses others.
        if albedo and not all(0 <= v <= 1 for v in values):
            raise ValueError(f"{name}: {own} {values} is not within 0 to 1")
    if material.kind == "mix":
        for own in material.parameters["materials"][1]:
            if own not in defined:
                raise ValueError(f"{name}: {own} is not defined before")
        if not 0 <= material.parameters["amount"][1][0] <= 1:
            raise ValueError(f"{name}: the amount is not within 0 to 1")
