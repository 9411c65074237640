"""Several measurements of one sample put together into one."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from data_formats.measurement import Channel, Measurement, MeasurementError, Symmetry
from data_formats.provenance import Note, Provenance
from data_formats.survey import detect_symmetry, repeats

_SAME_NM = 1e-6
# From the least to the most that a measurement says by symmetry.
_SYMMETRIES: tuple[Symmetry, ...] = ("anisotropic", "isotropic", "bilateral")


def join(*measurements: Measurement) -> Measurement:
    """The rows of all measurements, one after another: reflection with transmission, ...

    The frame of the sample (normal, `phi = 0`, front and back) must be the same in all of
    them; nothing in a file says so. Pairs of directions that several have stay as repeats.

    Channels are those of the first; the others' may be in another order. `symmetry` is
    that of the least symmetric. `auxiliary` keeps the columns that all have, with a note
    on those left out. Notes and header fields begin with the name of their file.
    `provenance.path` is `a + b`; its `sha256` is that of the files' sha256 in a row, each
    of which is in the header.

    Either all or none must have `sigma`. An uncertainty made up for the others would
    weigh them against the rest by a guess, masking their rows would lose data, and dropping
    the known one is for the user to decide: `dataclasses.replace(m, sigma=None)`.

    **Arguments:**

    - `measurements`: one or more, of one sample.

    **Raises:** `MeasurementError` if there is none, if channels differ in name or by more
    than 1e-6 nm, or if only some have `sigma`.
    """
    if not measurements:
        raise MeasurementError("there is nothing to join; give at least one measurement")
    if len(measurements) == 1:
        return measurements[0]
    names = _names(measurements)
    first = measurements[0]
    parts = [
        _with_channels(m, first, name, names[0])
        for name, m in zip(names, measurements, strict=True)
    ]
    _check_sigma(parts, names)
    common = [k for k in first.auxiliary if all(k in m.auxiliary for m in parts)]
    joined = Measurement(
        theta_i=_stacked([m.theta_i for m in parts]),
        phi_i=_stacked([m.phi_i for m in parts]),
        theta_r=_stacked([m.theta_r for m in parts]),
        phi_r=_stacked([m.phi_r for m in parts]),
        value=_stacked([m.value for m in parts]),
        valid=np.concatenate([m.valid for m in parts]),
        channels=first.channels,
        sigma=(
            None
            if first.sigma is None
            else _stacked([m.sigma for m in parts if m.sigma is not None])
        ),
        symmetry=_SYMMETRIES[min(_SYMMETRIES.index(m.symmetry) for m in parts)],
        provenance=_provenance(parts, names),
        auxiliary={k: _stacked([m.auxiliary[k] for m in parts]) for k in common},
    )
    own = [
        replace(note, sentence=f"{name}: {note.sentence}")
        for name, m in zip(names, parts, strict=True)
        for note in m.notes
    ]
    return replace(joined, notes=(*own, *_notes(joined, parts, names)))


def _stacked(arrays: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    return np.concatenate(arrays)


def _names(measurements: Sequence[Measurement]) -> list[str]:
    """What to call each: the file's name, its path where names repeat, else a number."""
    paths = [m.provenance.path for m in measurements]
    # What was joined before has several paths.
    files = [" + ".join(Path(one).name for one in p.split(" + ")) for p in paths]
    for names in (files, paths):
        if all(names) and len(set(names)) == len(names):
            return names
    return [f"{p or 'measurement'} [{k}]" for k, p in enumerate(paths, 1)]


def _with_channels(
    m: Measurement, first: Measurement, name: str, first_name: str
) -> Measurement:
    """The measurement with its channels in the order of those of the first."""
    order = [
        next((k for k, c in enumerate(m.channels) if _same(c, wanted)), None)
        for wanted in first.channels
    ]
    found = [k for k in order if k is not None]
    if len(found) < len(order) or len(found) != m.n_channels:
        lacking = [c for c, k in zip(first.channels, order, strict=True) if k is None]
        extra = [c for k, c in enumerate(m.channels) if k not in found]
        only = [
            f"only {which} has {_listed(channels)}"
            for which, channels in ((first_name, lacking), (name, extra))
            if channels
        ]
        raise MeasurementError(
            f"{first_name} and {name} cannot be joined, since {' and '.join(only)}; export "
            "them with the same channels"
        )
    if found == list(range(m.n_channels)):
        return m
    return replace(
        m,
        value=m.value[:, found],
        valid=m.valid[:, found],
        sigma=None if m.sigma is None else m.sigma[:, found],
        channels=first.channels,
    )


def _same(a: Channel, b: Channel) -> bool:
    if a.wavelength_nm is None or b.wavelength_nm is None:
        return a == b
    if abs(a.wavelength_nm - b.wavelength_nm) > _SAME_NM:
        return False
    # A name that only repeats the wavelength repeats its last digits, too.
    return a.name == b.name or all(Channel.at(c.wavelength_nm or 1) == c for c in (a, b))


def _listed(channels: Sequence[Channel]) -> str:
    shown = ", ".join(
        c.name
        if c.wavelength_nm is None or Channel.at(c.wavelength_nm) == c
        else f"{c.name} at {c.wavelength_nm:.12g} nm"
        for c in channels[:6]
    )
    more = len(channels) - 6
    return f"the channels {shown}" + (f" and {more} more" if more > 0 else "")


def _check_sigma(parts: Sequence[Measurement], names: Sequence[str]) -> None:
    having = [n for n, m in zip(names, parts, strict=True) if m.sigma is not None]
    lacking = [n for n, m in zip(names, parts, strict=True) if m.sigma is None]
    if having and lacking:
        raise MeasurementError(
            f"{having[0]} has uncertainties (sigma) and {lacking[0]} has none, so joined "
            "they could not be weighed against each other; add them there, or drop them "
            "with dataclasses.replace(measurement, sigma=None)"
        )


def _provenance(parts: Sequence[Measurement], names: Sequence[str]) -> Provenance:
    header: dict[str, str] = {}
    for name, m in zip(names, parts, strict=True):
        p = m.provenance
        known = {"path": p.path, "sha256": p.sha256, "format": p.format}
        known |= {"instrument": p.instrument, "sample": p.sample, "date": p.date}
        header |= {f"{name}: {k}": v for k, v in known.items() if v}
        header |= {f"{name}: {k}": v for k, v in p.header.items()}
    hashes = [m.provenance.sha256 for m in parts]
    both = hashlib.sha256("".join(hashes).encode()).hexdigest() if all(hashes) else ""
    return Provenance(
        path=" + ".join(m.provenance.path or n for n, m in zip(names, parts, strict=True)),
        sha256=both,
        format=_each([m.provenance.format for m in parts]),
        instrument=_each([m.provenance.instrument for m in parts]),
        sample=_each([m.provenance.sample for m in parts]),
        date=_each([m.provenance.date for m in parts]),
        header=header,
    )


def _each(texts: Sequence[str]) -> str:
    """Every different text that is known."""
    return " + ".join(dict.fromkeys(t for t in texts if t))


def _notes(
    joined: Measurement, parts: Sequence[Measurement], names: Sequence[str]
) -> list[Note]:
    rows = " and ".join(f"{n} ({m.n_rows} rows)" for n, m in zip(names, parts, strict=True))
    notes = [Note("joined", f"Joined: {rows}", joined.n_rows)]
    left_out = [
        f"{column} of {name}"
        for name, m in zip(names, parts, strict=True)
        for column in m.auxiliary
        if column not in joined.auxiliary
    ]
    if left_out:
        notes.append(
            Note(
                "auxiliary-left-out",
                f"Columns that not all files have were left out: {', '.join(left_out)}",
                len(left_out),
            )
        )
    if twice := repeats(joined) - sum(map(repeats, parts)):
        notes.append(
            Note(
                "duplicate-directions",
                f"rows that repeat a pair of directions of another file: {twice}; kept",
                twice,
            )
        )
    samples = [m.provenance.sample for m in parts if m.provenance.sample]
    if any(a != b for a, b in pairwise(samples)):
        notes.append(
            Note("perhaps-two-samples", f"The files name different samples: {samples}")
        )
    if joined.symmetry != "anisotropic" and detect_symmetry(joined) == "anisotropic":
        notes.append(
            Note(
                "perhaps-anisotropic",
                "The files have different phi_i: was the sample turned between them? It is "
                "taken for isotropic, as each file alone is",
            )
        )
    return notes
