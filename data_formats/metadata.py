"""What text tables written here carry beside their numbers, as one line of JSON."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, get_args

from data_formats.measurement import (
    Channel,
    Measurement,
    MeasurementError,
    Note,
    Provenance,
    Symmetry,
)
from data_formats.provenance import one_line
from data_formats.quantity import says_factor
from data_formats.source import Source

KEY = "MEASUREMENT_JSON"
# What damaged JSON, or JSON of another shape, leads to.
_ERRORS = (
    ValueError,
    TypeError,
    LookupError,
    AttributeError,
    ArithmeticError,
    RecursionError,
)


@dataclass(frozen=True)
class Metadata:
    """Everything of a `Measurement` that is not a number per row.

    `channels` and `auxiliary` are by the names of their columns in the file.
    """

    symmetry: Symmetry
    channels: dict[str, Channel]
    auxiliary: dict[str, str]
    notes: tuple[Note, ...]
    provenance: Provenance


def dump(
    measurement: Measurement, labels: Sequence[str], auxiliary: Mapping[str, str]
) -> str:
    """One line of ASCII.

    **Arguments:**

    - `measurement`: what is written.
    - `labels`: the names of the channels' columns in the file.
    - `auxiliary`: those of the auxiliary columns, by their names in the measurement.
    """
    return json.dumps(
        {
            "symmetry": measurement.symmetry,
            "channels": {
                label: [channel.name, channel.wavelength_nm]
                for label, channel in zip(labels, measurement.channels, strict=True)
            },
            "auxiliary": {label: name for name, label in auxiliary.items()},
            "notes": [[n.code, n.sentence, n.count] for n in measurement.notes],
            "provenance": asdict(measurement.provenance)
            | {"header": dict(measurement.provenance.header)},
        }
    )


def stated(fields: Mapping[str, str], where: str) -> Metadata | None:
    """What a header says, if this program wrote it; raises as `parse` does."""
    return parse(fields[KEY], where) if KEY in fields else None


def parse(text: str, where: str) -> Metadata:
    """The inverse of `dump`.

    **Raises:** `MeasurementError` beginning with `where` if the text was damaged.
    """
    try:
        return _parse(text)
    except _ERRORS as error:
        raise MeasurementError(
            f"{where}: the description of the measurement is damaged "
            f"({type(error).__name__}: {str(error)[:80]}); delete that line to read the "
            "numbers alone"
        ) from error


def _parse(text: str) -> Metadata:
    raw: dict[str, Any] = json.loads(text)
    if raw["symmetry"] not in get_args(Symmetry):
        raise ValueError(f"symmetry {raw['symmetry']!r}")
    channels = {
        str(label): Channel(str(name), None if nm is None else float(nm))
        for label, (name, nm) in raw["channels"].items()
    }
    auxiliary = {str(label): _text(n) for label, n in raw["auxiliary"].items()}
    notes = tuple(Note(str(c), str(s), int(n)) for c, s, n in raw["notes"])
    fields = {k: _text(v) for k, v in raw["provenance"].items() if k != "header"}
    header = {str(k): _text(v) for k, v in raw["provenance"]["header"].items()}
    return Metadata(
        raw["symmetry"], channels, auxiliary, notes, Provenance(**fields, header=header)
    )


def _text(content: object) -> str:
    if not isinstance(content, str):
        raise TypeError(f"expected text, found {type(content).__name__}")
    return content


def kept(provenance: Provenance, stored: Provenance) -> Provenance:
    """The provenance to keep: that of the measured file, if the container knows it."""
    if stored.sha256:
        return stored
    p = provenance
    return replace(stored, path=p.path, sha256=p.sha256, format=p.format)


def described(source: Source, format_name: str, fields: Mapping[str, str]) -> Provenance:
    """The provenance of a text file with header fields as in E1392 files."""
    date = fields.get("MEAS_DATE", "")
    return Provenance(
        path=source.path,
        sha256=source.sha256,
        format=format_name,
        instrument=fields.get("SYSTEM_NAME", ""),
        sample=fields.get("SAMPLE_NAME", ""),
        date="" if date.upper() == "UNKNOWN" else date,
        header=fields,
    )


def is_header_key(key: str) -> bool:
    """Whether a header field can stand in an E1392-style header under its own name."""
    return key.isascii() and key.isupper() and key.replace("_", "").isalnum()


def header_fields(provenance: Provenance) -> Mapping[str, str]:
    """The header to write for people: known fields under their names in E1392 files.

    A field that speaks of factors is left out: what is written is in 1/sr.
    """
    fields = {
        k: one_line(v)
        for k, v in provenance.header.items()
        if is_header_key(k) and k not in ("VARS", "NUM_POINTS", KEY)
        if not says_factor(k, v)
    }
    known = {
        "SYSTEM_NAME": provenance.instrument,
        "SAMPLE_NAME": provenance.sample,
        "MEAS_DATE": provenance.date,
    }
    stated = {k: one_line(v) for k, v in known.items() if v}
    return stated | fields | {"QUANTITY": "BSDF in 1/sr without cosine"}
