"""Angles of stored components, in as many digits as mpmath is set to."""

from __future__ import annotations

from dataclasses import dataclass

import mpmath as mp

INPUTS = ("wix", "wiy", "cos_i", "wox", "woy", "cos_o", "hx", "hy", "hz", "cos_d")


@dataclass(frozen=True)
class Angles:
    """Polar angles and azimuths of source, detector and half vector; difference angle."""

    theta_i: mp.mpf
    phi_i: mp.mpf
    theta_o: mp.mpf
    phi_o: mp.mpf
    theta_h: mp.mpf
    phi_h: mp.mpf
    theta_d: mp.mpf


def angles(components: dict[str, mp.mpf]) -> Angles:
    """Angles of stored components, whose lengths are 1 only up to rounding."""
    c = components

    def polar(x: str, y: str, z: str) -> tuple[mp.mpf, mp.mpf]:
        return mp.atan2(mp.hypot(c[x], c[y]), c[z]), mp.atan2(c[y], c[x])

    return Angles(
        *polar("wix", "wiy", "cos_i"),
        *polar("wox", "woy", "cos_o"),
        *polar("hx", "hy", "hz"),
        mp.acos(min(c["cos_d"], mp.mpf(1))),
    )
