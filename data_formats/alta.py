"""ALTA data (`.alta`, `.dat`): rows of numbers in one of many parametrisations.

Lines `#KEY value` make the header: `#DIM nx ny`, `#PARAM_IN` (what the first nx numbers of
a row are: angles in radians, vectors or cosines of the light `L` and the view `V`),
`#PARAM_OUT` (what the other ny are) and `#VS` (whether intervals follow them). Then text,
or, after `#FORMAT binary`, float64. Sources: `data_storage.cpp` and `params.cpp` of ALTA,
a library for the analysis of BRDFs (L. Belcour, P. Barla and R. Pacanowski, 2013).
"""

from __future__ import annotations

import os
import re
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from data_formats import metadata
from data_formats.alta_rows import COLOURS, WITH_COSINE, Layout, read_rows
from data_formats.directions import Angles, snap_to_edges
from data_formats.measurement import (
    Channel,
    Measurement,
    MeasurementError,
    Note,
    Provenance,
)
from data_formats.provenance import one_line
from data_formats.source import Source, load, write_text
from data_formats.survey import describe

NAME = "alta"
SUFFIXES = (".alta",)

_DIM = re.compile(rb"^#DIM\b", re.MULTILINE)
_FUNCTION = re.compile(rb"^#FUNC\b", re.MULTILINE)
# A product with the cosine says nothing about f below this cosine.
_LEAST_COSINE = 0.02


def sniff(head: bytes) -> bool:
    """Whether a line begins with `#DIM`, and none with `#FUNC`: a fit, not data."""
    return _DIM.search(head) is not None and _FUNCTION.search(head) is None


def read(
    path: str | os.PathLike[str],
    *,
    param_in: str | None = None,
    param_out: str | None = None,
) -> Measurement:
    """Read an ALTA file, text or binary.

    **Arguments:**

    - `path`: of the file; gzip is unpacked.
    - `param_in`: the parametrisation; `None`: as the file says.
    - `param_out`: `"INV_STERADIAN"`, `"INV_STERADIAN_COSINE_FACTOR"` (divided by the cosine
        of the view), `"RGB_COLOR"` or `"XYZ_COLOR"`; `None`: as the file says, else 1/sr.

    **Raises:** `MeasurementError` with file and line.
    """
    source = load(path)
    stated = {"PARAM_IN": param_in, "PARAM_OUT": param_out}
    given = {key: text for key, text in stated.items() if text is not None}
    layout, numbers, lines = read_rows(source, given)

    def where(row: int) -> str:
        return f"{source.path}, {f'line {lines[row]}' if lines else f'record {row + 1}'}"

    own = metadata.stated(layout.fields, source.path)
    n_x = len(layout.x.columns)
    value = numbers[:, n_x : n_x + layout.n_y]
    notes: list[Note] = []
    raw = layout.x.angles(*numbers[:, :n_x].T)
    for angle in raw:
        if not np.isfinite(angle).all():
            row = int(np.argmin(np.isfinite(angle)))
            shown = " ".join(f"{x:g}" for x in numbers[row, :n_x])
            raise MeasurementError(
                f"{where(row)}: {shown} is no pair of directions; expected "
                f"{', '.join(layout.x.columns)}"
            )
    angles: Angles = dict(zip(("theta_i", "phi_i", "theta_r", "phi_r"), raw, strict=True))
    if own is None:
        angles = snap_to_edges(angles, where, notes)
    value, valid = _in_steradian(value, angles, layout.output, notes)
    if not valid.any():
        raise MeasurementError(f"{source.path}: none of the {valid.size} values is valid")
    rest = numbers[:, n_x + layout.n_y :]
    if rest.size:
        notes.append(
            Note(
                "intervals-kept",
                "The file gives intervals of its values (#VS), which are no standard "
                "uncertainties; kept as the columns vs_1, ...",
            )
        )
    m = Measurement(
        **angles,
        value=value,
        valid=valid,
        channels=_channels(layout, own),
        provenance=_provenance(source, layout.fields),
        auxiliary={f"vs_{k}": column for k, column in enumerate(rest.T, 1)},
    )
    if own is not None:
        return replace(
            m,
            symmetry=own.symmetry,
            provenance=metadata.kept(m.provenance, own.provenance),
            notes=own.notes,
        )
    if layout.x.from_half:
        m = _above_horizon(m, notes)
    return describe(replace(m, notes=tuple(notes)))


def write(measurement: Measurement, path: str | os.PathLike[str]) -> None:
    """Write text in the parametrisation SPHERICAL_TL_PL_TV_PV.

    ALTA has no mask: rows with a value that is not valid are left out, and so are
    uncertainties and further columns.

    **Raises:** `MeasurementError` if no row is valid in every channel.
    """
    m = measurement.select(measurement.valid.all(axis=1))
    if not m.n_rows:
        raise MeasurementError("no row is valid in every channel, which ALTA asks for")
    names = "".join(c.name for c in m.channels)
    output = next((k for k, v in COLOURS.items() if v == names), "INV_STERADIAN")
    described = replace(m, auxiliary={}, sigma=None)
    lines = [
        "#ALTA_BEGIN_HEADER",
        f"#DIM 4 {m.n_channels}",
        "#PARAM_IN SPHERICAL_TL_PL_TV_PV",
        f"#PARAM_OUT {output}",
        "#VS 0",
        f"#{metadata.KEY} {metadata.dump(described, _labels(m.n_channels), {})}",
        "#ALTA_END_HEADER",
    ]
    table = np.column_stack([m.theta_i, m.phi_i, m.theta_r, m.phi_r, m.value])
    lines += [" ".join(map(repr, row)) for row in table.tolist()]
    write_text(path, "\n".join([*lines, ""]))


def _labels(n: int) -> list[str]:
    return [f"y_{k}" for k in range(1, n + 1)]


def _in_steradian(
    stored: NDArray[np.float64], angles: Angles, output: str, notes: list[Note]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Values in 1/sr without cosine, and which of them are valid."""
    valid = np.isfinite(stored)
    if missing := int(np.count_nonzero(~valid)):
        notes.append(
            Note(
                "not-finite-masked",
                f"values that are not finite: {missing}; masked",
                missing,
            )
        )
    if output == "UNKNOWN_OUTPUT" or output in COLOURS:
        notes.append(
            Note(
                "unit-assumed",
                f"The file says {output} of its values; they were read as BSDF in 1/sr "
                f"without cosine (param_out={WITH_COSINE} divides by it)",
            )
        )
    if output != WITH_COSINE:
        return stored, valid
    cosine = np.abs(np.cos(angles["theta_r"]))
    grazing = cosine < _LEAST_COSINE
    notes.append(
        Note(
            "cosine-divided", "The values had the cosine of theta_r in them: divided by it"
        )
    )
    if count := int(np.count_nonzero(grazing)):
        notes.append(
            Note(
                "grazing-masked",
                f"rows with theta_r within 1.1 degrees of the horizon, where dividing by "
                f"the cosine leaves nothing: {count}; masked",
                count,
            )
        )
    return stored / cosine[:, None], valid & ~grazing[:, None]


def _channels(layout: Layout, own: metadata.Metadata | None) -> tuple[Channel, ...]:
    labels = _labels(layout.n_y)
    if own is not None and list(own.channels) == labels:
        return tuple(own.channels.values())
    names = COLOURS.get(layout.output, "")
    if len(names) == layout.n_y:
        return tuple(map(Channel, names))
    return (Channel("mono"),) if layout.n_y == 1 else tuple(map(Channel, labels))


def _provenance(source: Source, fields: dict[str, str]) -> Provenance:
    return Provenance(
        path=source.path,
        sha256=source.sha256,
        format=NAME,
        sample=one_line(fields.get("SAMPLE", "")),
        header={k: one_line(v) for k, v in fields.items() if k != metadata.KEY},
    )


def _above_horizon(m: Measurement, notes: list[Note]) -> Measurement:
    """Without the rows of a grid of half angles that are no reflection from the front."""
    below = np.maximum(m.theta_i, m.theta_r) > np.pi / 2 + 1e-9
    if count := int(np.count_nonzero(below)):
        notes.append(
            Note(
                "below-horizon",
                f"rows whose half and difference angles put source or detector below the "
                f"horizon: {count}; left out",
                count,
            )
        )
        m = m.select(~below)
    if not m.valid.any():
        raise MeasurementError(
            f"{m.provenance.path}: no row with a valid value is above the horizon"
        )
    return m
