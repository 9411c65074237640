"""From a fitted model to another one: the fit as a noise-free measurement."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from data_formats import Channel, Measurement, Provenance
from fitting.model import Model
from fitting.models import AxisPeak
from fitting.result import FitResult

_THETA_I_DEG = (2.0, 15.0, 30.0, 45.0, 60.0, 75.0)
_RINGS = 11
_AROUND_PEAK = 12
_LARGEST_THETA_DEG = 80.0


def resample(result: FitResult) -> Measurement:
    """Values of a fitted model over the hemisphere, for fitting another model to.

    ``fit(resample(result), "disney")`` converts a result. The directions are rings of the
    detector for six angles of incidence, and half vectors on rings around the normal whose
    slopes go from a third of the narrowest lobe's width to 1, so that a peak is sampled
    whatever its width. For an anisotropic model the source goes around in steps of 30 deg.
    """
    model = Model(result.model)
    steps = np.radians(np.arange(0.0, 180.0, 30.0)) if model.anisotropic else (0.0,)
    angles = np.concatenate(
        [_directions(t, p, _narrowest(model, result)) for t in _THETA_I_DEG for p in steps],
        axis=1,
    )
    value = result.evaluate(*angles)
    value = value.reshape(value.shape[0], -1)
    return Measurement(
        *angles,
        value=value,
        valid=np.isfinite(value),
        channels=tuple(Channel(c.name, c.wavelength_nm) for c in result.channels),
        sigma=None,
        symmetry="anisotropic" if model.anisotropic else "bilateral",
        provenance=Provenance(
            path=result.data.path,
            sha256=result.data.sha256,
            format=f"values of the fitted {result.model}",
            sample=result.data.sample,
        ),
    )


def _narrowest(model: Model, result: FitResult) -> float:
    """The least slope width of the lobes, at most 1."""
    values = {p.name: float(np.min(p.value)) for p in result.parameters}
    widths = [1.0]
    with jax.enable_x64(True):
        known = {n: jnp.asarray(v) for n, v in values.items()}
        for i, lobe in enumerate(model.lobes):
            peak = lobe.peak(model.of_lobe(i, known))
            if isinstance(peak, AxisPeak):
                widths.append(float(np.sqrt(2.0 / (peak.exponent + 2.0))) / 2.0)
            elif peak is not None:
                widths.append(float(min(peak.alpha_x, peak.alpha_y)))
    return min(widths)


def _directions(theta_i_deg: float, phi_i: float, width: float) -> np.ndarray:
    """``theta_i, phi_i, theta_r, phi_r (4, n)`` in radians, for one source."""
    theta_i = np.radians(theta_i_deg)
    around = np.linspace(0.0, np.pi, 9)
    ring_theta, ring_phi = np.meshgrid(
        np.radians(np.linspace(0.0, _LARGEST_THETA_DEG, _RINGS)), around
    )
    slope, turn = np.meshgrid(np.geomspace(width / 3.0, 1.0, _AROUND_PEAK), around)
    theta_h = np.arctan(np.concatenate([[0.0], slope.ravel()]))
    phi_h = np.concatenate([[0.0], turn.ravel()])
    source = np.array([np.sin(theta_i), 0.0, np.cos(theta_i)])
    half = np.stack(
        [np.sin(theta_h) * np.cos(phi_h), np.sin(theta_h) * np.sin(phi_h), np.cos(theta_h)]
    )
    x, y, z = 2.0 * (source @ half) * half - source[:, None]
    theta_r = np.concatenate([ring_theta.ravel(), np.arctan2(np.hypot(x, y), z)])
    phi_r = np.concatenate([ring_phi.ravel(), np.arctan2(y, x)])
    seen = theta_r <= np.radians(_LARGEST_THETA_DEG) + 1e-9
    theta_r, phi_r = theta_r[seen], phi_r[seen]
    ones = np.ones_like(theta_r)
    return np.stack([theta_i * ones, phi_i * ones, theta_r, phi_i + phi_r])
