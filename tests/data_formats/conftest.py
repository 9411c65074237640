"""Measurements made up for the tests of the readers."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

Rows = np.ndarray


@pytest.fixture
def write_astm(tmp_path: Path) -> Callable[..., Path]:
    """Write rows as an E1392-style file; the header's other lines may be given."""

    def write(rows: Rows, variables: str, header: tuple[str, ...] = (), **kwargs) -> Path:
        path = tmp_path / kwargs.get("name", "made_up.astm")
        lines = [*header, f"NUM_POINTS {len(rows)}", f"VARS {variables}", ""]
        lines += [",".join(f"{x:.15g}" for x in row) for row in rows]
        path.write_text("\n".join([*lines, ""]))
        return path

    return write


@pytest.fixture
def cornell_rows() -> Rows:
    """A glossy paint as the Cornell instrument would see it: (n, 4 + 31)."""
    nm = np.arange(400, 701, 10)
    rows = []
    for theta_i in np.deg2rad(np.arange(10, 81, 10)):
        for k in range(10):
            theta_r = 2 * np.arcsin(k * np.sqrt(2) / 20)
            for phi in np.linspace(0, np.pi, 4 * k + 1):
                phi_r = phi if phi == np.pi else -phi
                cos_specular = np.cos(theta_i) * np.cos(theta_r) - np.sin(theta_i) * np.sin(
                    theta_r
                ) * np.cos(phi_r)
                gloss = np.exp((cos_specular - 1) / 0.003) * 30
                body = 0.05 + 0.0001 * nm
                rows.append([theta_i, 0, theta_r, phi_r, *(gloss + body)])
    return np.round(np.array(rows), 6)


@pytest.fixture
def shadowed_rows(cornell_rows: Rows) -> Rows:
    """The same with the rows that the real instrument shadows."""
    rows = cornell_rows.copy()
    off_specular = 180 - np.abs(np.rad2deg(rows[:, 3]))
    hidden = (np.abs(rows[:, 0] - np.deg2rad(80)) < 1e-3) & (rows[:, 2] > 1.37)
    hidden &= (off_specular > 9) & (off_specular < 26)
    rows[hidden, 4:] = 0.0003
    return rows


@pytest.fixture
def ramped_rows() -> Rows:
    """A paint as the Mini-Diff would write it: (n, 4 + 3), source at azimuth pi."""
    rows = []
    for theta_i in np.deg2rad([0, 20, 40]):
        for theta_deg in range(0, 91, 5):
            for phi in np.deg2rad(np.arange(0, 360, 30 if theta_deg else 360)):
                theta_r = np.deg2rad(theta_deg)
                at = min(theta_r, np.deg2rad(75))
                cos_specular = np.cos(theta_i) * np.cos(at) + np.sin(theta_i) * np.sin(
                    at
                ) * np.cos(phi)
                value = np.array([0.2, 0.1, 0.3]) + 5 * np.exp((cos_specular - 1) / 0.01)
                if theta_deg > 75:
                    value = value * (90 - theta_deg) / 15
                rows.append([theta_i, np.pi, theta_r, phi, *value])
    return np.array(rows)
