"""Surface scattering distribution data (`.ssdd`): tables over four lists of angles.

Lines of a keyword and its words; `# ` begins a comment; angles in degrees, values in 1/sr:

    VERSION 0.2
    DATA_TYPE brdf                  (btdf, specular_reflectance, specular_transmittance)
    COLOR_MODEL monochrome          (rgb, xyz, spectrum with WAVELENGTH_LIST in nm)
    PARAM_TYPE spherical_coordinate_system
    PARAM0_LIST 0 30 60             theta_i
    PARAM2_LIST 0 45 90             theta_r; PARAM1_LIST, phi_i, is left out if isotropic
    PARAM3_LIST 0 90 180            phi_r
    DATA ascii                      (binary: float32, little endian)
    0.31

The values follow, those of a channel side by side and PARAM0 running fastest. With
`specular_coordinate_system` PARAM2 and PARAM3 are the angle to the specular direction and
the azimuth around it, and PARAM4 is added to the theta of that direction; with
`half_difference_coordinate_system` the four are theta and phi of the half vector and of the
difference. A btdf is mirrored at the surface. Source: "Surface scattering distribution data
file format", version 0.2, R. Kimura, libbsdf.
"""

from __future__ import annotations

import os
import re

import numpy as np
from numpy.typing import NDArray

from data_formats.angle_grid import on_grid
from data_formats.half_difference import directions
from data_formats.measurement import Channel, Measurement, MeasurementError, Provenance
from data_formats.provenance import Note, one_line
from data_formats.source import load, write_text
from data_formats.specular_grid import (
    above_horizon,
    around_specular,
    columns_of,
    first_of_repeats,
    left_out_below,
)
from data_formats.ssdd_blocks import COLORS, SPECULAR, Block, blocks_of
from data_formats.table import Table, to_measurement

NAME = "ssdd"
SUFFIXES = (".ssdd",)

_MARK = re.compile(rb"^DATA_TYPE[ \t]+(?:brdf|btdf|specular_\w+)", re.MULTILINE)


def sniff(head: bytes) -> bool:
    """Whether a line is `DATA_TYPE` and one of the types."""
    return _MARK.search(head.replace(b"\r", b"\n")) is not None


def read(path: str | os.PathLike[str]) -> Measurement:
    """Read a SSDD file.

    **Arguments:**

    - `path`: of the file; gzip is unpacked.

    **Raises:** `MeasurementError` with file and line.
    """
    source = load(path)
    header, blocks = blocks_of(source)
    notes = [Note("degrees-converted", "Angles converted from degrees to radians")]
    kept = [b for b in blocks if b.kind not in SPECULAR]
    if len(kept) < len(blocks):
        left = ", ".join(b.kind for b in blocks if b.kind in SPECULAR)
        notes.append(
            Note(
                "specular-left-out",
                f"The file also has a table of {left}, which is no BSDF; left out",
                len(blocks) - len(kept),
            )
        )
    if not kept:
        raise MeasurementError(f"{source.path}: the file has neither a brdf nor a btdf")
    if len({b.kind for b in kept}) < len(kept) or len({b.channels for b in kept}) > 1:
        kinds = ", ".join(b.kind for b in kept)
        raise MeasurementError(
            f"{source.path}: the tables ({kinds}) have different channels or stand in the "
            "file twice; split it"
        )
    for block in kept:
        header.update({f"{block.kind} {k}": v for k, v in block.fields.items()})
    fields = kept[0].fields
    return to_measurement(
        Table(
            numbers=np.concatenate([_rows(block, notes) for block in kept]),
            columns=columns_of(list(kept[0].channels)),
            provenance=Provenance(
                path=source.path,
                sha256=source.sha256,
                format=NAME,
                instrument=fields.get("DEVICE", ""),
                sample=fields.get("NAME", ""),
                date=fields.get("MEASUREMENT_DATE", ""),
                header=header,
            ),
            notes=tuple(notes),
        ),
        quantity="bsdf",
    )


def write(measurement: Measurement, path: str | os.PathLike[str]) -> None:
    """Write a SSDD file in spherical coordinates, as text in full precision.

    Angles are rounded to 1e-9 degrees. Rows without a valid value are not written.

    **Raises:** `MeasurementError` if the rows of reflected or of transmitted light are no
    complete grid, a row is valid in some channels only, or the channels are not one, R G B,
    X Y Z or wavelengths.
    """
    m = measurement.select(measurement.valid.any(axis=1))
    if not m.n_rows or not m.valid.all():
        raise MeasurementError(
            "SSDD holds rows that are valid in all channels; "
            f"{int((~m.valid).any(axis=1).sum())} rows are in some only; write csv"
        )
    lines = ["VERSION 0.2"]
    for kind, rows in (("brdf", ~m.transmitted), ("btdf", m.transmitted)):
        if rows.any():
            lines += _table(m.select(rows), kind)
    write_text(path, "\n".join([*lines, ""]))


def _table(m: Measurement, kind: str) -> list[str]:
    """The lines of a table."""
    grid = on_grid(m, "SSDD")
    phi_r, value = grid.phi_r, grid.value
    if len(phi_r) > 1 and phi_r[0] == 0 and phi_r[-1] > 180:
        # Programs interpolate between the angles of the list, so it closes the circle.
        phi_r = np.append(phi_r, 360.0)
        value = np.concatenate([value, value[:, :, :, :1]], axis=3)
    lists = [grid.theta_i, grid.phi_i, grid.theta_r, phi_r]
    lines = ["", f"DATA_TYPE {kind}", *_colors(m.channels)]
    lines.append("PARAM_TYPE spherical_coordinate_system")
    if m.symmetry == "bilateral" and phi_r[-1] <= 180:
        lines.append("REDUCTION_TYPE bilateral_symmetry")
    for k, angles in enumerate(lists):
        if k != 1 or m.symmetry == "anisotropic":
            lines.append(f"PARAM{k}_LIST " + " ".join(f"{x:.13g}" for x in angles))
    p = m.provenance
    named = {"NAME": p.sample, "DEVICE": p.instrument, "MEASUREMENT_DATE": p.date}
    lines += [f"{key} {one_line(text)}" for key, text in named.items() if one_line(text)]
    table = np.transpose(value, (3, 2, 1, 0, 4)).reshape(-1, m.n_channels)
    rows = [" ".join(map(repr, row)) for row in table.tolist()]
    return [*lines, "DATA ascii", *rows]


def _colors(channels: tuple[Channel, ...]) -> list[str]:
    names = tuple(c.name for c in channels)
    wavelengths = [c.wavelength_nm for c in channels if c.wavelength_nm is not None]
    if len(wavelengths) == len(channels):
        listed = " ".join(map(repr, wavelengths))
        return ["COLOR_MODEL spectrum", f"WAVELENGTH_LIST {listed}"]
    model = next((k for k, v in COLORS.items() if v == names), "monochrome")
    if model == "monochrome" and len(channels) > 1:
        raise MeasurementError(
            "SSDD holds one channel, R G B, X Y Z or wavelengths; the channels are "
            f"{', '.join(names)[:100]}"
        )
    return [f"COLOR_MODEL {model}"]


def _rows(block: Block, notes: list[Note]) -> NDArray[np.float64]:
    """Four angles in radians and the values, without what is below the horizon."""
    grid = np.meshgrid(*block.angles[3::-1], indexing="ij")
    p3, p2, p1, p0 = (axis.ravel() for axis in grid)
    value = block.value.reshape(len(p0), -1)
    system = block.fields.get("PARAM_TYPE", "")
    if system.startswith("spherical"):
        angles = [p0, p1, p2, p3]
    elif system.startswith("specular"):
        offset = np.broadcast_to(block.angles[4], block.angles[0].shape)
        theta_s = np.broadcast_to(block.angles[0] + offset, grid[3].shape).ravel()
        theta_r, phi_r = around_specular(theta_s, p2, p3)
        angles = [p0, p1, theta_r, phi_r + p1]
    else:
        turned = p1 if len(block.angles[1]) > 1 else None
        angles = directions(p0, p2, p3, turned)
    rows = np.column_stack([*angles, value])
    if not system.startswith("spherical"):
        above = above_horizon(rows[:, 2])
        if system.startswith("half"):
            above &= above_horizon(rows[:, 0])
        left_out_below(~above, value, notes)
        rows = rows[above]
    if block.kind == "btdf":
        rows[:, 2] = np.pi - rows[:, 2]
    return rows[first_of_repeats(rows[:, :4], rows[:, 4:], notes)]
