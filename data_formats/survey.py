"""What a measurement's numbers show: symmetry, repeats, negative values, sides."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from data_formats.measurement import Measurement, Symmetry
from data_formats.provenance import Note

_ODD = np.uint64(0x9E3779B97F4A7C15)


def in_wavelength_order(measurement: Measurement) -> Measurement:
    """Channels in ascending order of wavelength, with a note if they were not."""
    wavelengths = measurement.wavelengths
    if wavelengths is None or (np.diff(wavelengths) > 0).all():
        return measurement
    order = np.argsort(wavelengths)
    sigma = measurement.sigma
    note = Note("channels-sorted", "Channels were not in the order of wavelength; sorted")
    return replace(
        measurement,
        value=measurement.value[:, order],
        valid=measurement.valid[:, order],
        sigma=None if sigma is None else sigma[:, order],
        channels=tuple(measurement.channels[k] for k in order),
        notes=(*measurement.notes, note),
    )


def describe(measurement: Measurement) -> Measurement:
    """State the symmetry that the directions show, and count what is worth knowing."""
    m = measurement
    counted = (
        (
            "transmitted-rows",
            m.transmitted,
            "rows of transmitted light (source and detector on different sides): {}",
        ),
        (
            "back-incidence",
            m.from_back,
            "rows with the sample lit from the back (theta_i > 90 degrees): {}",
        ),
        ("negative-values", m.valid & (m.value < 0), "negative values: {}; kept"),
    )
    notes = [
        Note(code, sentence.format(count), count)
        for code, which, sentence in counted
        if (count := int(np.count_nonzero(which)))
    ]
    if twice := repeats(m):
        notes.append(
            Note(
                "duplicate-directions",
                f"rows that repeat a pair of directions: {twice}",
                twice,
            )
        )
    symmetry = detect_symmetry(m)
    if symmetry == "bilateral":
        notes.append(
            Note(
                "half-hemisphere",
                "Only one side of the plane of incidence was measured; mirror symmetry is "
                "assumed",
            )
        )
    return replace(m, symmetry=symmetry, notes=(*m.notes, *notes))


def detect_symmetry(measurement: Measurement) -> Symmetry:
    """Anisotropic if there are several `phi_i`; bilateral if all is on one side.

    Lit from the back at `phi_i + pi`, a source is in the plane that it was in before: it
    went round in a circle.
    """
    m = measurement
    oblique = np.sin(m.theta_i) > 1e-6
    # Compared on the circle: -pi and pi are the same azimuth.
    front = np.exp(1j * m.phi_i[oblique & ~m.from_back])
    back = np.exp(1j * m.phi_i[oblique & m.from_back])
    if front.size and back.size and np.abs(front[0] + back[0]) < 1e-5:
        back = -back
    azimuths = np.concatenate([front, back])
    if azimuths.size and np.abs(azimuths - azimuths[0]).max() > 1e-5:
        return "anisotropic"
    side = np.sin(m.phi_r - m.phi_i)
    side = side[(np.sin(m.theta_r) > 1e-6) & oblique]
    if (side < -1e-5).any() != (side > 1e-5).any():
        return "bilateral"
    return "isotropic"


def repeats(measurement: Measurement) -> int:
    """How many rows have the four angles of an earlier row."""
    m = measurement
    mixed = np.zeros(m.n_rows, dtype=np.uint64)
    for angle in (m.theta_i, m.phi_i, m.theta_r, m.phi_r):
        mixed ^= (angle + 0.0).view(np.uint64)  # -0.0 is 0.0
        mixed *= _ODD
        mixed ^= mixed >> np.uint64(29)
    # Few rows share the mixture of their angles' bits by chance: those alone are compared.
    _, first, shared = np.unique(mixed, return_index=True, return_inverse=True)
    alike = np.bincount(shared, minlength=len(first))[shared] > 1
    angles = (a[alike].tolist() for a in (m.theta_i, m.phi_i, m.theta_r, m.phi_r))
    return int(np.count_nonzero(alike)) - len(set(zip(*angles, strict=True)))
