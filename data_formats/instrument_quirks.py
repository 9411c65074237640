"""What is known of instruments and not written in their files, found in the numbers.

The same measurement travels in several containers, under several names; its numbers are
what stays. One function per instrument; each returns the measurement unchanged if the
numbers are not from that instrument.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from data_formats.measurement import Measurement, Note

_CLOSE = 1e-5  # rad; files print six decimals


def apply_quirks(measurement: Measurement) -> Measurement:
    """Mask and note what the instruments known here get wrong."""
    for quirk in (cornell_gonioreflectometer, ramp_to_grazing, zeros_at_retro):
        measurement = quirk(measurement)
    return measurement


def cornell_gonioreflectometer(measurement: Measurement) -> Measurement:
    """Mask the shadowed rows of the Cornell gonioreflectometer; note its noise and zeros.

    Recognised by its directions: `theta_i` in steps of 10 degrees, `theta_r` on rings of
    equal area, `2 asin(k sqrt(2)/20)`, `phi_i = 0`. At `theta_i` = 80, `theta_r` = 79.05
    degrees the four rows at 10 to 25 degrees from the specular meridian are darker by a
    quarter or more than the one at 30, while the meridian itself is brighter by orders of
    magnitude: the detector was shadowed, and no file says so.

    Source: H. Li, S. Foo, K. Torrance, S. Westin, "Automated three-axis gonioreflectometer
    for computer graphics applications", 2005.
    """
    m = measurement
    if not _on_cornell_rings(m):
        return m
    shadowed = _cornell_shadow(m)
    notes = [
        Note(
            "cornell-spike",
            "Cornell gonioreflectometer: mirror directions are sampled by one row each; "
            "the height of a narrow specular peak is not reliable",
        )
    ]
    if count := int(np.count_nonzero(shadowed)):
        notes.append(
            Note(
                "cornell-shadow-masked",
                f"Cornell gonioreflectometer: {count} rows at theta_i = 80, theta_r = "
                "79.05 degrees, 10 to 25 degrees from the specular meridian, are darker "
                "than those farther from it (shadowed detector); masked",
                count,
            )
        )
    notes += _noise_below_420(m) + _zero_floor(m)
    valid = m.valid & ~shadowed[:, None]
    return replace(m, valid=valid, notes=(*m.notes, *notes))


def _on_cornell_rings(m: Measurement) -> bool:
    rings = 2 * np.arcsin(np.arange(10) * np.sqrt(2) / 20)
    ten = np.deg2rad(10)
    return bool(
        m.n_rows > 100
        and (np.abs(m.phi_i) < _CLOSE).all()
        and (np.abs(m.theta_i - ten * np.round(m.theta_i / ten)) < _CLOSE).all()
        and (np.abs(m.theta_r[:, None] - rings).min(axis=1) < _CLOSE).all()
    )


def _cornell_shadow(m: Measurement) -> NDArray[np.bool_]:
    """(n,) rows much darker than the row 30 degrees from the specular meridian."""
    level = np.where(m.valid, m.value, 0.0).mean(axis=1)
    ring = (np.abs(m.theta_i - np.deg2rad(80)) < _CLOSE) & (m.theta_r > np.deg2rad(79))
    off_specular = np.rad2deg(np.pi - np.abs(m.phi_r - m.phi_i))
    close = np.rad2deg(_CLOSE)
    reference = level[ring & (np.abs(off_specular - 30) < close)]
    specular = level[ring & (np.abs(off_specular) < close)]
    none = np.zeros(m.n_rows, dtype=bool)
    if not (reference.size and specular.size) or specular.max() < 10 * reference.max():
        return none
    nearer = (off_specular > 10 - close) & (off_specular < 25 + close)
    return ring & nearer & (level < 0.75 * reference.max())


def _noise_below_420(m: Measurement) -> list[Note]:
    """A note if the first channels scatter much more than those above 450 nm."""
    wavelengths = m.wavelengths
    if wavelengths is None or m.n_channels < 8:
        return []
    low, high = m.value[:, :-1], m.value[:, 1:]
    size = np.where(m.valid[:, :-1] & m.valid[:, 1:], (np.abs(low) + np.abs(high)) / 2, 0)
    step = np.full(low.shape, np.nan)
    np.divide(np.abs(high - low), size, out=step, where=size > 0)
    blue, rest = wavelengths[1:] <= 410, wavelengths[:-1] >= 450
    if not (np.isfinite(step[:, blue]).any() and np.isfinite(step[:, rest]).any()):
        return []
    noise, usual = np.nanmedian(step[:, blue]), np.nanmedian(step[:, rest])
    if noise < 3 * usual:
        return []
    return [
        Note(
            "cornell-noisy-blue",
            "Cornell gonioreflectometer: noisy at short wavelengths; the median step from "
            f"400 to 410 nm is {100 * noise:.0f} %, above 450 nm {100 * usual:.0f} %",
        )
    ]


def _zero_floor(m: Measurement) -> list[Note]:
    """A note if noise below zero was written as zero."""
    zeros = int(np.count_nonzero(m.valid & (m.value == 0)))
    if not zeros or (m.value < 0).any():
        return []
    return [
        Note(
            "clamped-zeros",
            f"Cornell gonioreflectometer: {zeros} values are exactly zero and none is "
            "negative: noise below zero was clamped before the file was written",
            zeros,
        )
    ]


def ramp_to_grazing(measurement: Measurement) -> Measurement:
    """Mask rows within 15 degrees of the horizon that are a straight ramp to zero.

    The Light Tec Mini-Diff V2 does not measure there; its files hold
    `v(75) (90 - theta_r)/15`, exact in the planes `phi_r` = 0, 90, 180 and 270 degrees and
    resampled between them. The same is looked for behind the surface, from 105 degrees. No
    surface does that to nine digits, so the planes decide for all rows of their incidence
    and side.
    """
    m = measurement
    knee = np.deg2rad(75)
    quarter = np.pi / 2
    in_plane = np.abs(m.phi_r - quarter * np.round(m.phi_r / quarter)) < _CLOSE
    elevation = np.abs(quarter - m.theta_r)
    beyond = elevation < quarter - knee - _CLOSE
    at_knee = np.abs(elevation - (quarter - knee)) < _CLOSE
    if not (in_plane & beyond).any() or not (in_plane & at_knee).any():
        return m
    masked = np.zeros(m.n_rows, dtype=bool)
    front, behind = m.theta_r < quarter + _CLOSE, m.theta_r > quarter - _CLOSE
    for incidence in np.unique(np.round(m.theta_i / _CLOSE)):
        for side in (front, behind):
            rows = side & (np.abs(m.theta_i / _CLOSE - incidence) < 1)
            if _is_ramp(m, rows & in_plane & at_knee, rows & in_plane & beyond):
                masked |= rows & beyond
    if not masked.any():
        return m
    count = int(np.count_nonzero(masked))
    note = Note(
        "ramp-masked",
        f"{count} rows less than 15 degrees off the surface are a straight ramp to zero, "
        "not a measurement; masked",
        count,
    )
    return replace(m, valid=m.valid & ~masked[:, None], notes=(*m.notes, note))


def _is_ramp(m: Measurement, knees: NDArray[np.bool_], beyond: NDArray[np.bool_]) -> bool:
    """Whether every row `beyond` is on the line from its plane's row at 75 degrees to 0."""
    if np.count_nonzero(beyond) < 5 or not (m.valid[knees].any() and m.valid[beyond].any()):
        return False
    plane = np.round(m.phi_r / (np.pi / 2)).astype(np.int64) % 4
    start = {int(plane[k]): m.value[k] for k in np.flatnonzero(knees)}
    rows = np.flatnonzero(beyond)
    if any(int(plane[k]) not in start for k in rows):
        return False
    top = np.array([start[int(plane[k])] for k in rows])
    slope = np.abs(np.pi / 2 - m.theta_r[rows]) / np.deg2rad(15)
    ramp = top * slope[:, None]
    scale = np.abs(top).max(axis=1, keepdims=True)
    return bool((scale > 0).all() and (np.abs(m.value[rows] - ramp) <= 1e-9 * scale).all())


def zeros_at_retro(measurement: Measurement) -> Measurement:
    """Mask rows of zeros around the retro direction, where the detector hides the source.

    Some in-plane goniometers write zeros in all channels there instead of leaving the rows
    out. Rows count as such if at least three of them lie within 15 degrees of the retro
    direction and no row there that is not zero lies between them and it.
    """
    m = measurement
    zero = (m.valid & (m.value == 0)).all(axis=1)
    # Behind the surface no detector hides a source that is in front of it.
    zero &= ~m.transmitted
    cos_retro = np.cos(m.theta_i) * np.cos(m.theta_r) + np.sin(m.theta_i) * np.sin(
        m.theta_r
    ) * np.cos(m.phi_r - m.phi_i)
    near = cos_retro > np.cos(np.deg2rad(15))
    hidden = zero & near
    for incidence in np.unique(np.round(m.theta_i[hidden] / _CLOSE)):
        rows = np.abs(m.theta_i / _CLOSE - incidence) < 1
        seen = rows & near & ~zero
        nearest_seen = cos_retro[seen].max() if seen.any() else -1.0
        hole = rows & hidden & (cos_retro > nearest_seen)
        hidden &= ~rows | (hole if np.count_nonzero(hole) >= 3 else False)
    if not hidden.any() or not (m.value[~hidden] != 0).any():
        return m
    count = int(np.count_nonzero(hidden))
    note = Note(
        "zeros-at-retro-masked",
        f"{count} rows around the retro direction are zero in all channels (the detector "
        "hides the source); masked",
        count,
    )
    return replace(m, valid=m.valid & ~hidden[:, None], notes=(*m.notes, note))
