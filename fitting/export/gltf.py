"""glTF 2.0: a metallic-roughness material (`.gltf`), with index and highlight strength.

Conventions of glTF 2.0: `roughnessFactor` is the root of the slope width of facets;
`baseColorFactor` is linear, with alpha 1; the dielectric's reflectance at normal incidence
is 0.04 unless KHR_materials_ior says another index, and KHR_materials_specular scales it
and its rim. Material extensions are written only where they differ from the defaults. A
fit of the lobe `gltf` is written as it is; anything else is refitted by it. The file holds
a material on a square, so that viewers show something.
"""

from __future__ import annotations

import base64
import json
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from fitting.export.channels import linear_srgb
from fitting.export.closest import ways_left_out
from fitting.export.one_lobe import OneLobe, one_lobe
from fitting.export.surface import surface_of
from fitting.export.target import Product, Request, Say
from fitting.result import FitResult

NAME = "gltf"
SUFFIXES = (".gltf",)
OPTIONS = ("channels", "illuminant")
REPRESENTATIONS = ()

_CONVENTIONS = (
    "roughnessFactor is the root of the slope width of facets",
    "baseColorFactor is linear: no screen encoding",
)
_FLOAT, _USHORT = 5126, 5123
_VERTICES, _INDICES = 34962, 34963


def make(result: FitResult, request: Request, path: Path, say: Say) -> Product:
    """The fit as a material of glTF. Raises `ExportError`."""
    mixing = linear_srgb(result.channels, request.channels, request.illuminant)
    surface = surface_of(result, mixing)
    found = one_lobe(surface, "gltf", say)

    def write(target: Path, comment: Sequence[str]) -> None:
        name = path.name.partition(".")[0] or "material"
        text = json.dumps(_document(name, found, comment), indent=1, allow_nan=False)
        target.write_text(text + "\n", encoding="utf-8")

    return Product(
        surface=surface,
        representation=found.representation,
        ways=("front",),
        conventions=(*_CONVENTIONS, f"colours: {mixing.sentence}"),
        remarks=(*found.remarks, *ways_left_out(surface, ("front",), "this material")),
        write=write,
    )


def _document(name: str, found: OneLobe, comment: Sequence[str]) -> dict[str, Any]:
    material = _material(name, found)
    used = list(material.get("extensions", ()))
    return {
        "asset": {
            "version": "2.0", "generator": "brdf export",
            "extras": {"comment": list(comment)},
        },
        **({"extensionsUsed": used} if used else {}),
        "materials": [material],
        **_square(),
    }  # fmt: skip


def _material(name: str, found: OneLobe) -> dict[str, Any]:
    extensions: dict[str, Any] = {}
    if found["ior"] != 1.5:
        extensions["KHR_materials_ior"] = {"ior": found["ior"]}
    if found["specular"] != 1.0:
        extensions["KHR_materials_specular"] = {"specularFactor": found["specular"]}
    return {
        "name": name,
        "pbrMetallicRoughness": {
            "baseColorFactor": [*found.base_color, 1.0],
            "metallicFactor": found["metallic"],
            "roughnessFactor": found["roughness"],
        },
        **({"extensions": extensions} if extensions else {}),
    }


def _square() -> dict[str, Any]:
    """A square of side 2 that faces +z, with its data in the file."""
    corners = [(-1.0, -1.0, 0.0), (1.0, -1.0, 0.0), (1.0, 1.0, 0.0), (-1.0, 1.0, 0.0)]
    data = b"".join(struct.pack("<3f", *c) for c in corners)
    data += struct.pack("<12f", *[0.0, 0.0, 1.0] * 4)
    data += struct.pack("<6H", 0, 1, 2, 0, 2, 3)
    encoded = base64.b64encode(data).decode("ascii")

    def view(offset: int, size: int, target: int) -> dict[str, int]:
        return {"buffer": 0, "byteOffset": offset, "byteLength": size, "target": target}

    def accessor(k: int, kind: int, count: int, of: str, **more: Any) -> dict[str, Any]:
        return {"bufferView": k, "componentType": kind, "count": count, "type": of, **more}

    return {
        "buffers": [
            {
                "byteLength": len(data),
                "uri": f"data:application/octet-stream;base64,{encoded}",
            }
        ],
        "bufferViews": [
            view(0, 48, _VERTICES), view(48, 48, _VERTICES), view(96, 12, _INDICES),
        ],
        "accessors": [
            accessor(0, _FLOAT, 4, "VEC3", min=[-1.0, -1.0, 0.0], max=[1.0, 1.0, 0.0]),
            accessor(1, _FLOAT, 4, "VEC3"),
            accessor(2, _USHORT, 6, "SCALAR"),
        ],
        "meshes": [
            {
                "primitives": [
                    {
                        "attributes": {"POSITION": 0, "NORMAL": 1},
                        "indices": 2, "material": 0,
                    }
                ]
            }
        ],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
        "scene": 0,
    }  # fmt: skip
