"""Zemax tabular BSDF (`.bsdf`): a polar grid around the specular direction.

Comments begin with `#`; all else is a stream of words, whatever the line breaks:

    Source Measured
    Symmetry PlaneSymmetrical        (Asymmetrical, Asymmetrical4D)
    SpectralContent Monochrome       (XYZ)
    ScatterType BRDF                 (BTDF)
    SampleRotation 1    0
    AngleOfIncidence 2  10 30
    ScatterAzimuth 3    0 90 180
    ScatterRadial 2     0 5
    Monochrome                       (TristimulusX, then Y and Z)
    DataBegin
    TIS 0.13  then, azimuth by azimuth, one value per radial angle; for each rotation and
    DataEnd   incidence

in degrees and 1/sr. `AngleOfIncidence` is the angle of the specular direction, radial 0;
for a BTDF that of direct transmission, behind the surface. Azimuth 0 points from there to
the normal. Zeros below the horizon, and zeros that run to the edge of the grid, are places
where nothing was measured. A rotation of the sample is read as `phi_i`. Source: "Zemax
Tabular BSDF data file format" (article of Zemax / Ansys), first the "BSDF Data Interchange"
of Radiant Imaging.
"""

from __future__ import annotations

import os
import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from data_formats.measurement import Channel, Measurement, MeasurementError, Provenance
from data_formats.provenance import Note, one_line
from data_formats.source import load, write_text
from data_formats.specular_grid import (
    above_horizon,
    around_specular,
    columns_of,
    first_of_repeats,
    left_out_below,
    masked_zeros,
    zeros_at_the_edge,
)
from data_formats.specular_table import around_the_mirror
from data_formats.table import Table, to_measurement
from data_formats.token_stream import Tokens

NAME = "zemax"
SUFFIXES = (".bsdf",)

_MARK = re.compile(rb"(?:\A|[\r\n])[ \t]*AngleOfIncidence[ \t]+\d", re.IGNORECASE)
_WORDS = {
    "source": (),
    "symmetry": ("planesymmetrical", "asymmetrical", "asymmetrical4d"),
    "spectralcontent": ("monochrome", "xyz"),
    "scattertype": ("brdf", "btdf"),
}
_LISTS = {
    "samplerotation": (-360.0, 360.0),
    "angleofincidence": (0.0, 90.0),
    "scatterazimuth": (-360.0, 360.0),
    "scatterradial": (0.0, 180.0),
}
_BLOCKS = {
    "monochrome": [("Monochrome", "mono")],
    "xyz": [("TristimulusX", "X"), ("TristimulusY", "Y"), ("TristimulusZ", "Z")],
}
_NM = re.compile(r"(?<![\w.])(\d{3,5}(?:\.\d+)?) ?nm\b|\(nm\) ?= ?(\d{3,5}(?:\.\d+)?)")


def sniff(head: bytes) -> bool:
    """Whether a line begins with `AngleOfIncidence` and a number."""
    return _MARK.search(head) is not None


def read(path: str | os.PathLike[str]) -> Measurement:
    """Read a Zemax tabular BSDF file.

    **Arguments:**

    - `path`: of the file; gzip is unpacked.

    **Raises:** `MeasurementError` with file and line.
    """
    source = load(path)
    lines = source.lines()
    comments = [one_line(x.partition("#")[2]) for x in lines if x.lstrip()[:1] == "#"]
    tokens = Tokens.of(source.path, lines)
    words, lists = _header(tokens)
    kind = words["spectralcontent"].lower()
    btdf = words["scattertype"].lower() == "btdf"
    rotation, incidence, azimuth, radial = (np.deg2rad(lists[name]) for name in _LISTS)
    shape = (len(rotation), len(incidence), len(azimuth), len(radial))

    cubes: list[NDArray[np.float64]] = []
    integrals: list[str] = []
    for keyword, _ in _BLOCKS[kind]:
        tokens.expect(keyword)
        cubes.append(_block(tokens, shape, integrals))
    if tokens.peek():
        raise MeasurementError(
            f"{tokens.where()}: found {tokens.peek()[:30]!r} after the last DataEnd; "
            "expected the end of the file, so split it there"
        )

    table = np.stack(cubes, axis=-1)
    spent = zeros_at_the_edge(np.moveaxis(table, -1, 0))
    grid = np.meshgrid(rotation, incidence, azimuth, radial, indexing="ij")
    phi_i, theta_i, around, off = (axis.ravel() for axis in grid)
    theta_r, phi_r = around_specular(theta_i, off, around)
    value = table.reshape(-1, len(cubes))
    empty = np.moveaxis(spent, 0, -1).reshape(value.shape)

    notes: list[Note] = []
    above = above_horizon(theta_r)
    left_out_below(~above, value, notes)
    if btdf:
        theta_r = np.pi - theta_r
    angles = np.column_stack([theta_i, phi_i, theta_r, phi_r + phi_i])
    rows = np.hstack([angles, value, (~empty).astype(np.float64)])[above]
    rows = rows[first_of_repeats(rows[:, :4], rows[:, 4:], notes)]
    if count := int(np.count_nonzero(rows[:, 4 + len(cubes) :] == 0)):
        notes.append(masked_zeros(count))
    notes += _remarks(words, rotation, comments)
    header = {**words, **{k: " ".join(f"{x:g}" for x in v) for k, v in lists.items()}}
    header["tis"] = " ".join(integrals)
    if comments:
        header["comments"] = "\n".join(comments)
    sample = next((c.partition(":")[2] for c in comments if c.startswith("Sample:")), "")
    return to_measurement(
        Table(
            numbers=rows,
            columns=columns_of([Channel(n) for _, n in _BLOCKS[kind]], masks=True),
            provenance=Provenance(
                path=source.path,
                sha256=source.sha256,
                format=NAME,
                sample=sample.strip(),
                header=header,
            ),
            notes=tuple(notes),
        ),
        quantity="bsdf",
    )


def write(measurement: Measurement, path: str | os.PathLike[str]) -> None:
    """Write a Zemax tabular BSDF, if the directions are a grid around the specular one.

    Angles are rounded to 1e-9 degrees; masked values at the edge of the grid become zero,
    which is how they are read. TIS is the integral by the trapezoidal rule.

    **Raises:** `MeasurementError` if the directions are no such grid, light is both
    reflected and transmitted or from the back, or the channels are not one, or X Y Z.
    """
    m = measurement
    names = tuple(c.name for c in m.channels)
    kind = "xyz" if names == ("X", "Y", "Z") else "monochrome"
    if len(names) != len(_BLOCKS[kind]):
        raise MeasurementError(
            f"Zemax holds one channel, or X Y Z; the channels are {', '.join(names)[:100]}"
        )
    btdf = bool(m.transmitted.any())
    if m.from_back.any() or not (m.transmitted == btdf).all():
        raise MeasurementError(
            "Zemax holds reflected light alone or transmitted light alone, lit from the "
            "front; write csv"
        )
    table = around_the_mirror(m, "Zemax")
    plane = bool(table.azimuth[-1] <= 180)
    lists = (table.rotation, table.incidence, table.azimuth, table.radial)
    around = "Asymmetrical4D" if len(table.rotation) > 1 else "Asymmetrical"
    lines = [
        "Source  Measured",
        f"Symmetry  {'PlaneSymmetrical' if plane else around}",
        f"SpectralContent  {'XYZ' if kind == 'xyz' else 'Monochrome'}",
        f"ScatterType  {'BTDF' if btdf else 'BRDF'}",
    ]
    keys = ("SampleRotation", "AngleOfIncidence", "ScatterAzimuth", "ScatterRadial")
    for key, angles in zip(keys, lists, strict=True):
        lines += [f"{key}  {len(angles)}", "\t".join(f"{x:.12g}" for x in angles)]
    for k, (keyword, _) in enumerate(_BLOCKS[kind]):
        lines += ["", keyword, "DataBegin"]
        blocks = table.value[..., k].reshape(-1, len(table.azimuth), len(table.radial))
        totals = table.integral[..., k].ravel()
        for block, total in zip(blocks.tolist(), totals.tolist(), strict=True):
            lines += [f"TIS {total:.6g}", *("\t".join(map(repr, row)) for row in block)]
        lines.append("DataEnd")
    write_text(path, "\n".join([*lines, ""]))


def _header(tokens: Tokens) -> tuple[dict[str, str], dict[str, NDArray[np.float64]]]:
    """The keywords with a word, and those with a list in degrees, in lower case."""
    words: dict[str, str] = {}
    lists: dict[str, NDArray[np.float64]] = {}
    while len(words) + len(lists) < len(_WORDS) + len(_LISTS):
        where = tokens.where()
        key = tokens.take("a keyword of the header")
        name = key.lower()
        if name in words or name in lists:
            raise MeasurementError(f"{where}: {key} stands in the header twice")
        if name in _WORDS:
            word = tokens.take(f"the word after {key}")
            known = _WORDS[name]
            if known and word.lower() not in known:
                raise MeasurementError(
                    f"{where}: {key} is {word[:30]!r}; expected one of {', '.join(known)}"
                )
            words[name] = word
        elif name in _LISTS:
            lists[name] = _angles(tokens, key, where)
        else:
            missing = [k for k in (*_WORDS, *_LISTS) if k not in words and k not in lists]
            raise MeasurementError(
                f"{where}: found {key[:30]!r}; expected one of {', '.join(missing)}, which "
                "a Zemax BSDF file has before its data"
            )
    return words, lists


def _angles(tokens: Tokens, key: str, where: str) -> NDArray[np.float64]:
    angles = tokens.numbers(tokens.count(f"angles of {key}"), f"angles of {key}")
    low, high = _LISTS[key.lower()]
    if not ((angles >= low) & (angles <= high)).all():
        raise MeasurementError(
            f"{where}: angles of {key} from {angles.min():g} to {angles.max():g}; expected "
            f"{low:g} to {high:g} degrees"
        )
    return angles


def _block(
    tokens: Tokens, shape: tuple[int, int, int, int], integrals: list[str]
) -> NDArray[np.float64]:
    """(rotations, incidences, azimuths, radials) the values of one channel."""
    tokens.expect("DataBegin")
    size = shape[2] * shape[3]
    parts: list[NDArray[np.float64]] = []
    for _ in range(shape[0] * shape[1]):
        tokens.expect("TIS")
        integrals.append(tokens.take("the TIS"))
        parts.append(tokens.numbers(size, "values after a TIS"))
    tokens.expect("DataEnd")
    return np.concatenate(parts).reshape(shape)


def _remarks(
    words: dict[str, str], rotation: NDArray[np.float64], comments: Sequence[str]
) -> list[Note]:
    notes = [Note("degrees-converted", "Angles converted from degrees to radians")]
    if words["symmetry"].lower() != "planesymmetrical" and len(rotation) == 1:
        notes.append(
            Note(
                "stated-asymmetrical",
                "The file says that the sample is asymmetrical, but has it at one rotation "
                "only",
            )
        )
    if len(rotation) > 1:
        notes.append(
            Note(
                "sample-rotation",
                f"{len(rotation)} rotations of the sample read as phi_i; the sense of the "
                "rotation is not defined by the format",
                len(rotation),
            )
        )
    found = {a or b for a, b in _NM.findall("\n".join(comments))}
    if len(found) == 1:
        notes.append(
            Note(
                "perhaps-wavelength",
                f"The format has no field for the wavelength; a comment speaks of "
                f"{found.pop()} nm",
            )
        )
    return notes
