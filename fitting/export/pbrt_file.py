"""Materials of pbrt-v4 as text."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from data_formats import Channel

# nm; spectra of pbrt are zero outside of their range.
_ENDS = (360.0, 830.0)


@dataclass(frozen=True)
class Leaf:
    """A material: its type and parameters, arrays ``(c,)`` being colours or spectra."""

    kind: str
    parameters: dict[str, float | bool | np.ndarray]


@dataclass(frozen=True)
class Mix:
    """``(1 - amount) first + amount second``."""

    first: Leaf | Mix
    second: Leaf | Mix
    amount: float


def as_text(
    name: str, root: Leaf | Mix, channels: Sequence[Channel], comment: Sequence[str]
) -> str:
    """``MakeNamedMaterial`` for every part, the last under the name itself."""
    spectral = all(c.wavelength_nm is not None for c in channels)
    lines = [f"# {line}" for line in comment]
    lines.append(f'# use: Include "{name}.pbrt", then NamedMaterial "{name}"')

    def add(material: Leaf | Mix, own: str) -> None:
        if isinstance(material, Leaf):
            said = "".join(
                f"\n  {_parameter(n, v, channels, spectral)}"
                for n, v in material.parameters.items()
            )
            lines.append(f'MakeNamedMaterial "{own}" "string type" "{material.kind}"{said}')
            return
        add(material.first, f"{own}.a")
        add(material.second, f"{own}.b")
        lines.append(
            f'MakeNamedMaterial "{own}" "string type" "mix"\n'
            f'  "string materials" [ "{own}.a" "{own}.b" ]\n'
            f'  "float amount" [ {material.amount:.9g} ]'
        )

    add(root, name)
    return "\n".join(lines) + "\n"


def _parameter(
    name: str, value: float | bool | np.ndarray, channels: Sequence[Channel], spectral: bool
) -> str:
    if isinstance(value, bool):
        return f'"bool {name}" [ {str(value).lower()} ]'
    if not isinstance(value, np.ndarray):
        return f'"float {name}" [ {value:.9g} ]'
    if not spectral:
        return f'"rgb {name}" [ {" ".join(f"{v:.9g}" for v in value)} ]'
    at = sorted(
        (float(c.wavelength_nm or 0.0), float(v))
        for c, v in zip(channels, value, strict=True)
    )
    first, last = min(_ENDS[0], at[0][0] - 1.0), max(_ENDS[1], at[-1][0] + 1.0)
    pairs = [(first, at[0][1]), *at, (last, at[-1][1])]
    return f'"spectrum {name}" [ {" ".join(f"{w:g} {v:.9g}" for w, v in pairs)} ]'
