"""Speos / OPTIS text (`.anisotropicbsdf`, `.brdf`): tables of theta by phi, not absolute.

The lines of an anisotropic file: title; 0 (text; 1 is binary and refused); comment; length
of the description and the description; anisotropy vector; two flags, reflection and
transmission; 1 (values proportional to the BSDF) or 0 (to the intensity, the BSDF times a
cosine); for each flag the anisotropy angles and, for each of them, the incidences, each
list after its count; for each flag the theta and phi of a spectrum, a comment, and the
spectrum in nm and percent, after its count. A `.brdf` file has no vector, and after the
value type the counts and the lists of incidences and wavelengths. Then, for each incidence
(and wavelength, with a line of percent before it), a line `n_theta n_phi`, a line of phi,
and rows of theta and values. Angles are in degrees; the specular direction, and direct
transmission, are at phi 0; theta beyond 90 is transmitted. The percentages, which are those
of all scattered light, give the values their scale: `scale="stated"`. Source: "Structure of
BRDF files", "Structure of anisotropic BSDF files", Ansys Speos user's guide.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from data_formats.counted_lines import CountedLines
from data_formats.measurement import Channel, Measurement, MeasurementError, Provenance
from data_formats.provenance import Note, one_line
from data_formats.source import Source, load
from data_formats.specular_grid import (
    columns_of,
    first_of_repeats,
    masked_zeros,
    projected_integral,
    zeros_at_the_edge,
)
from data_formats.table import Table, to_measurement

NAME = "speos"
SUFFIXES = (".anisotropicbsdf", ".brdf")

Scale = Literal["as-written", "stated"]

_TITLE = re.compile(r"OPTIS - (Anisotropic BSDF|brdf) surface file v(\d+)", re.IGNORECASE)
_OLDEST = 7
_SMALLEST_COSINE = 0.02


def sniff(head: bytes) -> bool:
    """Whether the file begins with `OPTIS - `."""
    return head.removeprefix(b"\xef\xbb\xbf").startswith(b"OPTIS - ")


@dataclass
class _Part:
    """Reflection or transmission: what its tables are of, in their order."""

    name: str
    geometries: list[tuple[float, float]] = field(default_factory=list)
    percent: float = np.nan
    reference: float = np.nan


@dataclass
class _Grid:
    """One table: anisotropy angle and incidence in degrees, and numbers."""

    part: _Part
    geometry: tuple[float, float]
    percent: float
    theta: NDArray[np.float64]
    phi: NDArray[np.float64]
    value: NDArray[np.float64]


def read(path: str | os.PathLike[str], *, scale: Scale = "as-written") -> Measurement:
    """Read a text file of Speos.

    **Arguments:**

    - `path`: of the file; gzip is unpacked.
    - `scale`: `"as-written"`: keep the values, which are only proportional to the BSDF;
        `"stated"`: scale them such that their integral over the projected solid angle is
        the percentage that the file states.

    **Raises:** `MeasurementError` with file and line.
    """
    if scale not in get_args(Scale):
        known = ", ".join(map(repr, get_args(Scale)))
        raise MeasurementError(f"scale is {scale!r}; expected one of {known}")
    source = load(path)
    header, anisotropic, lines = _header(source)
    flags = lines.numbers("two flags, reflection and transmission", 2)
    names = ("reflection", "transmission")
    parts = [_Part(name) for name, flag in zip(names, flags, strict=True) if flag]
    if not parts:
        raise MeasurementError(f"{lines.where}: the file says that it holds no data (0 0)")
    kind = lines.numbers("the type of values", 1)[0]
    if kind not in (0, 1):
        raise MeasurementError(
            f"{lines.where}: the type of values is {kind:g}; expected 1 or 0"
        )
    channels, grids = (_anisotropic if anisotropic else _spectral)(lines, parts, header)
    lines.expect_end()
    notes: list[Note] = []
    if not kind:
        notes.append(
            Note("cosine-divided", "The values are intensities: divided by cos(theta_r)")
        )
        for grid in grids:
            cosine = np.abs(np.cos(np.deg2rad(grid.theta)))[:, None]
            cosine[cosine < _SMALLEST_COSINE] = np.nan
            grid.value = grid.value / cosine
    notes.append(_scaled(grids, scale))
    rows, kept = _rows(grids, len(channels), notes)
    return to_measurement(
        Table(
            numbers=rows[kept],
            columns=columns_of(channels, "deg", masks=True),
            provenance=Provenance(
                path=source.path, sha256=source.sha256, format=NAME, header=header
            ),
            notes=tuple(notes),
        ),
        quantity="bsdf",
    )


def _header(source: Source) -> tuple[dict[str, str], bool, CountedLines]:
    # A binary file of Speos begins with the same two lines.
    head = source.data[:200].decode("latin-1").removeprefix("\xef\xbb\xbf")
    title, _, rest = head.replace("\r\n", "\n").partition("\n")
    match = _TITLE.match(title.strip())
    if match is None or int(match[2]) < _OLDEST:
        raise MeasurementError(
            f"{source.path}: the file begins with {title[:50]!r}; expected an OPTIS "
            f"anisotropic BSDF or brdf surface file of version {_OLDEST} or later"
        )
    if rest[:1] == "1" or "\0" in head:
        raise MeasurementError(
            f"{source.path}, line 2: this is a binary file of Speos, which is not read; "
            "save it as text"
        )
    lines = CountedLines(source.path, source.lines(), 1)
    lines.numbers("0 for a text file", 1)
    header = {"title": one_line(title), "comment": one_line(lines.text("a comment"))}
    length = lines.numbers("the length of the description", 1)[0]
    description: list[str] = [lines.text("the description")]
    while sum(len(x) + 1 for x in description) - 1 < length:
        description.append(lines.text("the description"))
    header["description"] = one_line(" ".join(description))
    anisotropic = match[1].lower() != "brdf"
    if anisotropic:
        vector = lines.numbers("the anisotropy vector", 3)
        header["anisotropy vector"] = " ".join(f"{x:g}" for x in vector)
    return header, anisotropic, lines


def _anisotropic(
    lines: CountedLines, parts: Sequence[_Part], header: dict[str, str]
) -> tuple[list[Channel], list[_Grid]]:
    for part in parts:
        (count,) = lines.counts("the number of anisotropy angles")
        for turn in lines.angles("anisotropy angles", count, 360):
            (count,) = lines.counts("the number of incidences")
            part.geometries += [(turn, i) for i in lines.angles("incidences", count, 90)]
    for part in parts:
        part.reference = lines.numbers("theta and phi of the spectrum", 2)[0]
        lines.text("a comment on the spectrum")
        (count,) = lines.counts("the number of wavelengths")
        spectrum = [lines.numbers("wavelength and percent", 2) for _ in range(count)]
        header[f"spectrum of {part.name}"] = "; ".join(
            f"{nm:g} nm {percent:g} %" for nm, percent in spectrum
        )
        if len({percent for _, percent in spectrum}) == 1:
            part.percent = spectrum[0][1]
    tables = ((p, g, p.percent) for p in parts for g in p.geometries)
    return [Channel("mono")], [_grid(lines, *t) for t in tables]


def _spectral(
    lines: CountedLines, parts: Sequence[_Part], header: dict[str, str]
) -> tuple[list[Channel], list[_Grid]]:
    n_incidences, n_channels = lines.counts("the numbers of incidences and wavelengths", 2)
    incidences = lines.angles("incidences", n_incidences, 90)
    channels = [Channel.at(w) for w in lines.numbers("wavelengths", n_channels)]
    grids: list[_Grid] = []
    percents: list[str] = []
    for part in parts:
        for incidence in incidences:
            for _ in range(n_channels):
                percent = lines.numbers("the percentage of a table", 1)[0]
                percents.append(f"{percent:g}")
                grids.append(_grid(lines, part, (0.0, incidence), percent))
    header["percent"] = " ".join(percents)
    return channels, grids


def _grid(
    lines: CountedLines, part: _Part, geometry: tuple[float, float], percent: float
) -> _Grid:
    n_theta, n_phi = lines.counts("the numbers of theta and phi", 2)
    phi = lines.angles("phi of a table", n_phi, 360)
    rows: list[list[float]] = []
    for _ in range(n_theta):
        rows.append(lines.numbers("theta and the values of a table", n_phi + 1))
        theta = rows[-1][0]
        low, high = (90, 180) if part.name == "transmission" else (0, 90)
        if not low <= theta <= high:
            raise MeasurementError(
                f"{lines.where}: theta is {theta:g} degrees in a table of {part.name}; "
                f"expected {low} to {high}"
            )
    table = np.array(rows, dtype=np.float64)
    return _Grid(part, geometry, percent, table[:, 0], np.array(phi), table[:, 1:])


def _factor(grid: _Grid, grids: Sequence[_Grid]) -> float:
    """From the values of a table to the BSDF; NaN if the file does not give it."""
    part = grid.part
    if np.isfinite(part.reference):
        # One percentage for all tables, at the incidence of the spectrum.
        mine = [g for g in grids if g.part is part]
        grid = mine[np.argmin([abs(g.geometry[1] - part.reference) for g in mine])]
    integral = projected_integral(np.deg2rad(grid.theta), np.deg2rad(grid.phi), grid.value)
    return grid.percent / 100 / integral if integral > 0 and grid.percent > 0 else np.nan


def _scaled(grids: Sequence[_Grid], scale: Scale) -> Note:
    """The note on the scale of the values, which is applied if `scale` says so."""
    factors = [_factor(grid, grids) for grid in grids]
    low, high = f"{min(factors):.4g}", f"{max(factors):.4g}"
    span = low if low == high else f"{low} to {high}"
    known = bool(np.isfinite(factors).all())
    if scale == "as-written":
        how = f"; scale='stated' multiplies them by {span}" if known else ""
        return Note(
            "only-proportional",
            "The values are only proportional to the BSDF, not in 1/sr; kept as they are"
            f"{how}",
        )
    if not known:
        raise MeasurementError(
            "the percentages of the file do not give a scale (a spectrum that is not flat, "
            "or an integral that is not positive); read it with scale='as-written'"
        )
    for grid, factor in zip(grids, factors, strict=True):
        grid.value = grid.value * factor
    return Note(
        "scaled",
        f"Values multiplied by {span}, such that their integral is the percentage that the "
        "file states",
    )


def _rows(
    grids: Sequence[_Grid], n_channels: int, notes: list[Note]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Four angles in degrees, values and masks, and which rows repeat no other."""
    blocks: list[NDArray[np.float64]] = []
    for group in _by_channels(grids, n_channels):
        first = group[0]
        turn, incidence = first.geometry
        theta, phi = (a.ravel() for a in np.meshgrid(first.theta, first.phi, indexing="ij"))
        value = np.stack([g.value.ravel() for g in group], axis=1)
        # Towards the horizon: theta up to 90 in front, down to 90 behind.
        towards = slice(None, None, -1 if first.part.name == "transmission" else 1)
        empty = [zeros_at_the_edge(g.value[towards].T).T[towards].ravel() for g in group]
        angles = [
            np.full(len(theta), incidence),
            np.full(len(theta), 180.0 - turn),
            theta,
            phi - turn,
        ]
        seen = (~np.stack(empty, axis=1)).astype(np.float64)
        blocks.append(np.column_stack([*angles, value, seen]))
    rows = np.concatenate(blocks)
    kept = first_of_repeats(np.deg2rad(rows[:, :4]), rows[:, 4:], notes)
    if count := int(np.count_nonzero(rows[kept, 4 + n_channels :] == 0)):
        notes.append(masked_zeros(count))
    return rows, kept


def _by_channels(grids: Sequence[_Grid], n_channels: int) -> Iterator[Sequence[_Grid]]:
    """The tables of one geometry together, if they have the same directions."""
    for start in range(0, len(grids), n_channels):
        group = grids[start : start + n_channels]
        first = group[0]
        if not all(
            np.array_equal(first.theta, g.theta) and np.array_equal(first.phi, g.phi)
            for g in group
        ):
            raise MeasurementError(
                f"the tables at incidence {first.geometry[1]:g} degrees have different "
                "theta or phi at different wavelengths; split the file by wavelength"
            )
        yield group
