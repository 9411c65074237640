"""Made-up files in the container `tensor_file`."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from pathlib import Path

import numpy as np

_TYPES = {"u1": 1, "u2": 3, "f4": 10, "f8": 11}


def write_tensor_file(path: Path, fields: Mapping[str, np.ndarray]) -> Path:
    path.write_bytes(tensor_file(fields))
    return path


def tensor_file(fields: Mapping[str, np.ndarray]) -> bytes:
    size = 18 + sum(13 + len(name) + 8 * a.ndim for name, a in fields.items())
    head, body = b"tensor_file\0\1\0" + struct.pack("<I", len(fields)), b""
    for name, a in fields.items():
        body += bytes(-(size + len(body)) % 8)
        kind = _TYPES[a.dtype.str[1:]]
        head += struct.pack("<H", len(name)) + name.encode()
        head += struct.pack("<HBQ", a.ndim, kind, size + len(body))
        head += struct.pack(f"<{a.ndim}Q", *a.shape)
        body += a.tobytes()
    assert len(head) == size
    return head + body


def _smooth(rng: np.random.Generator, *shape: int) -> np.ndarray:
    return (0.5 + rng.random(shape)).astype("<f4")


def rgl_fields(
    phi_i: list[float], seed: int = 0, nm=(400, 500, 650)
) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(seed)
    slices = (len(phi_i), 3)
    # An isotropic sample's projected area does not depend on the azimuth, the rows.
    sigma = _smooth(rng, 5 if len(phi_i) > 2 else 1, 6)
    return {
        "description": np.frombuffer(b"made-up paint", "u1"),
        "phi_i": np.array(phi_i, "<f4"),
        "theta_i": np.array([0.1, 0.6, 1.2], "<f4"),
        "ndf": _smooth(rng, 7, 9),
        "sigma": np.tile(sigma, (5 // len(sigma), 1)),
        "vndf": _smooth(rng, *slices, 8, 10),
        "luminance": _smooth(rng, *slices, 4, 4),
        "spectra": _smooth(rng, *slices, len(nm), 4, 4),
        "wavelengths": np.array(nm, "<f4"),
        "jacobian": np.ones(1, "u1"),
    }


def kaist_fields(n_phi: int = 9, n_theta: int = 5, seed: int = 0) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(seed)
    theta = np.linspace(0, np.pi / 2, n_theta).astype("<f4")[None]
    return {
        "theta_h": theta,
        "theta_d": theta,
        "phi_d": np.linspace(-np.pi, np.pi, n_phi).astype("<f4")[None],
        "wvls": np.array([450, 500, 550, 600, 650], "<u2"),
        "M": _smooth(rng, n_phi, n_theta, n_theta, 5, 4, 4),
    }
