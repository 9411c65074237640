"""BSDF XML of WINDOW and Radiance (`.xml`): Klems matrices and tensor trees.

Reflection and transmission from the front and the back all become rows of one measurement,
and each `Wavelength` (Visible, Solar, ..., or a number) a channel. `z` points out of the
side that the file calls front (Radiance calls it the back) and `y` is that of the file, so
that azimuths are 180 degrees minus those of the file. Each value is the average over a
patch of incident and a patch of outgoing directions, given at their centres; the column
`projected_solid_angle` (sr) is that of the outgoing patch, so that values times it, summed
over the rows of one direction of incidence, are the reflectance or transmittance. Sources:
"BSDF-v1.4.xsd" of LBNL; `bsdf_m.c` and `bsdf_t.c` of Radiance.
"""

from __future__ import annotations

import os
import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from data_formats import klems, plain_xml, tensor_tree
from data_formats.measurement import (
    PROJECTED_SOLID_ANGLE,
    Channel,
    Measurement,
    MeasurementError,
    Note,
    Provenance,
)
from data_formats.patches import Group, Patches
from data_formats.plain_xml import Element
from data_formats.provenance import one_line
from data_formats.source import Source, load
from data_formats.survey import describe, in_wavelength_order
from data_formats.window_writer import write as write

NAME = "window"
SUFFIXES = (".xml",)

_ROOT = re.compile(rb"<(?:\w+:)?WindowElement\b")
_DIRECTION = re.compile(r"(transmission|reflection)\s+(front|back)", re.IGNORECASE)
_NM_PER = {"nanometer": 1.0, "nm": 1.0, "micrometer": 1e3, "micron": 1e3, "um": 1e3}
_CHROMATICITY = ("cie-u", "cie-v")
_RANKS = {"TensorTree3": 3, "TensorTree4": 4}


@dataclass
class _Reading:
    """What is found while reading."""

    source: Source
    structure: str
    bases: dict[str, klems.Basis]
    chromaticity: int = 0
    beyond: int = 0


def sniff(head: bytes) -> bool:
    """Whether it is XML with a `WindowElement`."""
    text = head.replace(b"\0", b"") if head[:2] in (b"\xff\xfe", b"\xfe\xff") else head
    start = text.lstrip(b"\xef\xbb\xbf\xff\xfe \t\r\n")
    return start.startswith(b"<") and _ROOT.search(start) is not None


def read(path: str | os.PathLike[str]) -> Measurement:
    """Read a BSDF XML file.

    **Raises:** `MeasurementError` with the line if the XML is damaged, if a matrix has
    another count of numbers than its angle bases say, or a tree does not add up.
    """
    source = load(path)
    root = plain_xml.parse(source)
    if root.name != "WindowElement":
        raise MeasurementError(
            f"{source.path}: the XML is a {root.name[:40]!r}; expected a WindowElement"
        )
    layers = [e for e in root.all("Optical", "Layer") if any(e.all("WavelengthData"))]
    if len(layers) != 1:
        raise MeasurementError(
            f"{source.path}: the file has {len(layers)} layers with WavelengthData; "
            "expected one; export the layer, or the whole system, alone"
        )
    (layer,) = layers
    reading = _reading(source, layer)
    groups = _groups(reading, layer)
    channels = list(dict.fromkeys(c for g in groups for c in g.values))
    value = np.concatenate([g.columns(channels) for g in groups])
    lacking = value.size - sum(g.patches.area.size * len(g.values) for g in groups)
    valid = np.isfinite(value)
    if not valid.any():
        raise MeasurementError(f"{source.path}: none of the {valid.size} values is valid")
    angles = [g.angles() for g in groups]
    m = Measurement(
        theta_i=np.concatenate([a[0] for a in angles]),
        phi_i=np.concatenate([a[1] for a in angles]),
        theta_r=np.concatenate([a[2] for a in angles]),
        phi_r=np.concatenate([a[3] for a in angles]),
        value=value,
        valid=valid,
        channels=tuple(channels),
        provenance=_provenance(source, layer, reading.structure),
        notes=_notes(reading, lacking, int(np.count_nonzero(~valid)) - lacking),
        auxiliary={PROJECTED_SOLID_ANGLE: np.concatenate([g.patches.area for g in groups])},
    )
    return describe(in_wavelength_order(m))


def _reading(source: Source, layer: Element) -> _Reading:
    definition = next(layer.all("DataDefinition"), None)
    structure = definition.at("IncidentDataStructure") if definition else ""
    if definition is None or structure not in ("Columns", "Rows", *_RANKS):
        raise MeasurementError(
            f"{source.path}: IncidentDataStructure is {structure[:40]!r}; expected "
            "Columns, Rows, TensorTree3 or TensorTree4"
        )
    bases = dict(klems.BASES)
    for element in definition.all("AngleBasis"):
        bases[element.at("AngleBasisName")] = klems.basis(element, source.path)
    return _Reading(source, structure, bases)


def _groups(reading: _Reading, layer: Element) -> list[Group]:
    """The blocks of the file, those on the same patches together."""
    groups: dict[object, Group] = {}
    channels: dict[str, Channel] = {}
    for data in layer.all("WavelengthData"):
        for wavelength in list(data.all("Wavelength"))[:1] or [data]:
            name = wavelength.text if wavelength is not data else ""
            if name.lower() in _CHROMATICITY:
                reading.chromaticity += 1
                continue
            channel = _channel(reading.source, wavelength, name)
            channel = channels.setdefault(channel.name.lower(), channel)
            for element in data.all("WavelengthDataBlock"):
                way, side, patches, value = _block(reading, element)
                group = groups.setdefault(
                    (way, side, patches.key), Group(way, side, patches)
                )
                if channel in group.values:
                    raise MeasurementError(
                        f"{reading.source.path}, line {element.line}: a second block of "
                        f"{way} {side} for {channel.name}; delete one"
                    )
                group.values[channel] = value
    if not groups:
        raise MeasurementError(
            f"{reading.source.path}: there is no WavelengthDataBlock in it"
        )
    return list(groups.values())


def _channel(source: Source, element: Element, name: str) -> Channel:
    unit = element.attributes.get("unit", "")
    try:
        number = float(name)
    except ValueError:
        name = one_line(name)[:80]
        if not name:
            raise MeasurementError(
                f"{source.path}, line {element.line}: WavelengthData has no Wavelength"
            ) from None
        return Channel(name[4:] if name.upper() in ("CIE-X", "CIE-Y", "CIE-Z") else name)
    if unit.lower() not in _NM_PER or not 0 < number < 1e6:
        raise MeasurementError(
            f"{source.path}, line {element.line}: the wavelength is {name[:20]!r} in the "
            f"unit {unit[:20]!r}; expected Nanometer or Micrometer"
        )
    return Channel.at(round(number * _NM_PER[unit.lower()], 9))


def _block(
    reading: _Reading, element: Element
) -> tuple[str, str, Patches, NDArray[np.float64]]:
    path = reading.source.path
    text = element.at("WavelengthDataDirection")
    match = _DIRECTION.fullmatch(text)
    if match is None:
        raise MeasurementError(
            f"{path}, line {element.line}: WavelengthDataDirection is {text[:40]!r}; "
            "expected Transmission or Reflection, Front or Back"
        )
    way, side = match[1].lower(), match[2].lower()
    data = next(element.all("ScatteringData"), element)
    where = f"{path}, line {data.line}: {match[1]} {match[2]}"
    if reading.structure in _RANKS:
        tree = tensor_tree.cells(data.text, _RANKS[reading.structure], where)
        patches, value, beyond = tensor_tree.pairs(tree)
        reading.beyond += beyond
        return way, side, patches, value
    columns = _basis(reading, element, "ColumnAngleBasis")
    rows = _basis(reading, element, "RowAngleBasis")
    shape = (klems.patch_count(rows), klems.patch_count(columns))
    numbers = _numbers(data, where)
    if numbers.size != shape[0] * shape[1]:
        raise MeasurementError(
            f"{where} has {numbers.size} numbers; expected {shape[0]} x {shape[1]} = "
            f"{shape[0] * shape[1]}, as its angle bases say; export the file again"
        )
    matrix = numbers.reshape(shape)
    if reading.structure == "Rows":
        rows, columns, matrix = columns, rows, matrix.T
    return way, side, klems.pairs(columns, rows), matrix.ravel()


def _basis(reading: _Reading, element: Element, name: str) -> klems.Basis:
    text = element.at(name)
    if text not in reading.bases:
        known = one_line(", ".join(reading.bases)[:300])
        raise MeasurementError(
            f"{reading.source.path}, line {element.line}: {name} is {text[:60]!r}, which "
            f"the file does not define; known are {known}"
        )
    return reading.bases[text]


def _numbers(data: Element, where: str) -> NDArray[np.float64]:
    words = data.text.replace(",", " ").split()
    try:
        return np.array(list(map(float, words)), dtype=np.float64)
    except ValueError as error:
        raise MeasurementError(f"{where}: {str(error)[:80]}") from None


def _provenance(source: Source, layer: Element, structure: str) -> Provenance:
    header = {"IncidentDataStructure": structure}
    for material in list(layer.all("Material"))[:1]:
        for element in material.children:
            unit = element.attributes.get("unit", "")
            header[element.name] = one_line(f"{element.text} {unit}")
    for data in layer.all("WavelengthData"):
        for name in ("SourceSpectrum", "DetectorSpectrum"):
            if text := one_line(data.at(name)):
                header[f"{name} {one_line(data.at('Wavelength'))}"] = text
    return Provenance(
        path=source.path,
        sha256=source.sha256,
        format=NAME,
        sample=header.get("Name", ""),
        header=header,
    )


def _notes(reading: _Reading, lacking: int, not_finite: int) -> tuple[Note, ...]:
    notes = [
        Note(
            "patch-averages",
            "Each value is the average over a patch of incident and a patch of outgoing "
            "directions, not a sample at the centres that are given; narrow lobes are "
            "flattened",
        ),
        Note(
            "front-is-up",
            "z points out of the side that the file calls front; azimuths are 180 degrees "
            "minus those of the file",
        ),
    ]
    counted = (
        (
            "channel-lacking",
            "values that the file has for other channels only: {}; masked",
            lacking,
        ),
        (
            "not-finite-masked",
            "values that are not finite: {}; masked",
            not_finite,
        ),
        (
            "chromaticity-left-out",
            "wavelengths that hold chromaticity (CIE-u, CIE-v) and no BSDF: {}; left out",
            reading.chromaticity,
        ),
        (
            "beyond-grazing",
            "cells of trees of rank 3 beyond grazing incidence: {}; left out",
            reading.beyond,
        ),
    )
    notes += [Note(code, text.format(n), n) for code, text, n in counted if n]
    return tuple(notes)
