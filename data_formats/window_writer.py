"""BSDF XML of WINDOW and Radiance from rows at the centres of its patches."""

from __future__ import annotations

import os
from collections.abc import Iterator
from xml.sax.saxutils import escape

import numpy as np
from numpy.typing import NDArray

from data_formats import klems, tensor_tree
from data_formats.measurement import PROJECTED_SOLID_ANGLE, Channel, Measurement
from data_formats.measurement import MeasurementError as Error
from data_formats.source import write_text

Array = NDArray[np.float64]

# rad; how far from its centre the direction of a patch may be given.
_ON_CENTRE = 1e-6
_CIE = {"X": "CIE-X", "Y": "CIE-Y", "Z": "CIE-Z"}
_HEAD = """<?xml version="1.0" encoding="UTF-8"?>
{comment}<WindowElement xmlns="http://windows.lbl.gov" \
xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" \
xsi:schemaLocation="http://windows.lbl.gov/BSDF-v1.4.xsd">
<WindowElementType>System</WindowElementType>
<FileType>BSDF</FileType>
<Optical>
<Layer>
<Material>
<Name>{name}</Name>
<Manufacturer></Manufacturer>
<DeviceType>Other</DeviceType>
</Material>
<DataDefinition>
<IncidentDataStructure>{structure}</IncidentDataStructure>
{bases}</DataDefinition>
"""
_BLOCK = """<WavelengthData>
<LayerNumber>System</LayerNumber>
<Wavelength unit="{unit}">{wavelength}</Wavelength>
<WavelengthDataBlock>
<WavelengthDataDirection>{direction}</WavelengthDataDirection>
{basis}
<ScatteringDataType>BTDF</ScatteringDataType>
<ScatteringData>
{data}
</ScatteringData>
</WavelengthDataBlock>
</WavelengthData>
"""


def write(
    measurement: Measurement, path: str | os.PathLike[str], comment: str = ""
) -> None:
    """Write Klems matrices or tensor trees, whichever the rows are.

    Rows at all pairs of centres of a Klems basis become a matrix. Other rows are the cells
    of a tree, whose sizes are those of the column `projected_solid_angle`; a tree is
    isotropic if all directions of incidence have one azimuth. Numbers keep all digits.

    **Raises:** `MeasurementError` if the rows are neither, are not complete, or a value is
    masked, which these files cannot say.
    """
    m = measurement
    if wrong := int(np.count_nonzero(~m.valid)):
        raise Error(
            f"BSDF XML has no mask, and {wrong} values are not valid; write csv, or fit a "
            "model and export that"
        )
    blocks: list[str] = []
    structures: set[str] = set()
    defined = ""
    for direction, rows in _ways(m):
        own = m.select(rows)
        structure, basis, texts, definition = _block(own, direction)
        structures.add(structure)
        defined = defined or definition
        for channel, data in zip(m.channels, texts, strict=True):
            unit, wavelength = _wavelength(channel)
            text = _BLOCK.format(
                unit=unit, wavelength=wavelength, direction=direction, basis=basis,
                data=data,
            )  # fmt: skip
            blocks.append(text)
    if len(structures) > 1:
        found = " and ".join(sorted(structures))
        raise Error(f"BSDF XML holds one structure; the rows are {found}; write csv")
    # A comment may not hold two hyphens.
    said = f"<!--\n{comment.replace('--', '- -')}\n-->\n" if comment else ""
    head = _HEAD.format(
        comment=said, name=escape(m.provenance.sample or "sample"),
        structure=structures.pop(), bases=defined,
    )  # fmt: skip
    write_text(path, head + "".join(blocks) + "</Layer>\n</Optical>\n</WindowElement>\n")


def _ways(m: Measurement) -> Iterator[tuple[str, Array]]:
    """The name of each way of light in the file, and its rows."""
    for transmitted in (False, True):
        for back in (False, True):
            rows = (m.transmitted == transmitted) & (m.from_back == back)
            if rows.any():
                way = "Transmission" if transmitted else "Reflection"
                yield f"{way} {'Back' if back else 'Front'}", rows


def _block(m: Measurement, direction: str) -> tuple[str, str, list[str], str]:
    """Structure, name of the basis, a text per channel, and the basis's definition."""
    theta_i, theta_r = (np.minimum(t, np.pi - t) for t in (m.theta_i, m.theta_r))
    phi_i, phi_r = np.pi - m.phi_i, np.pi - m.phi_r
    for name, basis in klems.BASES.items():
        size = klems.patch_count(basis)
        if m.n_rows != size * size:
            continue
        order = _matrix_order(klems.pairs(basis, basis), theta_i, phi_i, theta_r, phi_r)
        if order is None:
            continue
        tables = m.value[order].T.reshape(m.n_channels, size, size)
        texts = [",\n".join(", ".join(map(repr, r)) for r in t.tolist()) for t in tables]
        said = (
            f"<ColumnAngleBasis>{name}</ColumnAngleBasis>\n"
            f"<RowAngleBasis>{name}</RowAngleBasis>"
        )
        return "Columns", said, texts, klems.definition(name)
    area = m.auxiliary.get(PROJECTED_SOLID_ANGLE)
    if area is None:
        raise Error(
            f"{direction}: the {m.n_rows} rows are not at the centres of a Klems basis, "
            f"and no column {PROJECTED_SOLID_ANGLE} tells the cells of a tree; write csv, "
            "or fit a model and export that"
        )
    tree = tensor_tree.cells_at(theta_i, phi_i, theta_r, phi_r, area, direction)
    texts = [tree.text(column.tolist()) for column in m.value.T]
    return (
        f"TensorTree{tree.rank}", "<AngleBasis>LBNL/Shirley-Chiu</AngleBasis>", texts, "",
    )  # fmt: skip


def _matrix_order(
    patches, theta_i: Array, phi_i: Array, theta_r: Array, phi_r: Array
) -> NDArray[np.int64] | None:
    """Which row is that of each pair of patches; None if some pair has none."""

    def keys(theta_i: Array, phi_i: Array, theta_r: Array, phi_r: Array) -> Array:
        vectors: list[Array] = []
        for t, p in ((theta_i, phi_i), (theta_r, phi_r)):
            # The azimuth of a pole is none.
            vectors += [np.cos(t), np.sin(t) * np.cos(p), np.sin(t) * np.sin(p)]
        return np.stack(vectors, axis=1)

    wanted = keys(patches.theta_i, patches.phi_i, patches.theta_r, patches.phi_r)
    found = keys(theta_i, phi_i, theta_r, phi_r)
    places = np.lexsort(np.round(found, 5).T + 0.0)
    targets = np.lexsort(np.round(wanted, 5).T + 0.0)
    off = np.abs(found[places] - wanted[targets])
    if np.max(off) > _ON_CENTRE:
        return None
    order = np.empty(len(places), dtype=np.int64)
    order[targets] = places
    return order


def _wavelength(channel: Channel) -> tuple[str, str]:
    if channel.wavelength_nm is not None:
        return "Nanometer", f"{channel.wavelength_nm:.12g}"
    return "Integral", escape(_CIE.get(channel.name, channel.name))
