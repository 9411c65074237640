"""Made-up BSDF XML files: Klems matrices and tensor trees."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

# A tree: numbers of a leaf's grid, or the 2^rank nodes in a node.
Tree = list


def bases(**rings: Sequence[tuple[float, float, int]]) -> str:
    out = ""
    for name, parts in rings.items():
        out += f"<AngleBasis><AngleBasisName>{name}</AngleBasisName>"
        for low, high, n in parts:
            out += (
                f"<AngleBasisBlock><Theta>{(low + high) / 2}</Theta><nPhis>{n}</nPhis>"
                f"<ThetaBounds><LowerTheta>{low}</LowerTheta><UpperTheta>{high}</UpperTheta>"
                "</ThetaBounds></AngleBasisBlock>\n"
            )
        out += "</AngleBasis>"
    return out


def matrix(
    direction: str,
    numbers: np.ndarray,
    columns: str,
    rows: str,
    wavelength: str = "Visible",
) -> str:
    lines = ",\n".join(", ".join(map(repr, row)) for row in numbers.tolist())
    return block(
        direction,
        f"<ColumnAngleBasis>{columns}</ColumnAngleBasis>"
        f"<RowAngleBasis>{rows}</RowAngleBasis>",
        lines + ",",
        wavelength,
    )


def tree(direction: str, node: Tree, wavelength: str = "Visible") -> str:
    basis = "<AngleBasis>LBNL/Shirley-Chiu</AngleBasis>"
    return block(direction, basis, braces(node), wavelength)


def braces(node: Tree) -> str:
    if isinstance(node[0], list):
        return "{" + "\n".join(map(braces, node)) + "}"
    return "{ " + " ".join(map(repr, node)) + " }"


def block(direction: str, basis: str, data: str, wavelength: str = "Visible") -> str:
    unit = "Nanometer" if wavelength.isdigit() else "Integral"
    return (
        f'<WavelengthData><Wavelength unit="{unit}">{wavelength}</Wavelength>\n'
        "<SourceSpectrum>D65</SourceSpectrum><WavelengthDataBlock>\n"
        f"<WavelengthDataDirection>{direction}</WavelengthDataDirection>{basis}\n"
        f"<ScatteringDataType>BTDF</ScatteringDataType><ScatteringData>\n{data}\n"
        "</ScatteringData></WavelengthDataBlock></WavelengthData>\n"
    )


def document(structure: str, *blocks: str, definition: str = "") -> str:
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n<!-- made up -->\n'
        '<WindowElement xmlns="http://windows.lbl.gov">\n<Optical><Layer>\n'
        "<Material><Name>Opal &amp; glass</Name></Material>\n<DataDefinition>\n"
        f"<IncidentDataStructure>{structure}</IncidentDataStructure>{definition}\n"
        f"</DataDefinition>\n{''.join(blocks)}</Layer></Optical></WindowElement>\n"
    )


def random_tree(rank: int, rng: np.random.Generator, depth: int = 3) -> Tree:
    kind = rng.integers(4)
    if depth and kind < 2:
        return [random_tree(rank, rng, depth - 1) for _ in range(1 << rank)]
    side = 2 if kind == 2 and depth else 1
    return rng.random(side**rank).tolist()
