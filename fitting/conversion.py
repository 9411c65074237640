"""From a fitted model to another one: the fit as a noise-free measurement."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from data_formats import Channel, Measurement, Provenance
from fitting.model import Model
from fitting.models import AxisPeak, Way
from fitting.models.lobe import FROM_BACK, THROUGH
from fitting.models.retro import Retro
from fitting.models.turned_over import TurnedOver
from fitting.result import FitResult

_THETA_I_DEG = (2.0, 15.0, 30.0, 45.0, 60.0, 75.0)
_RINGS = 11
_AROUND_PEAK = 12
_LARGEST_THETA_DEG = 80.0


def resample(result: FitResult) -> Measurement:
    """Values of a fitted model over the hemisphere, for fitting another model to.

    ``fit(resample(result), "disney")`` converts a result. The directions are rings of the
    detector for six angles of incidence, and rings around the peak of every lobe, from a
    third of its least width on, so that it is sampled whatever its width. For an
    anisotropic model the source goes around in steps of 30 deg. Every way of light that
    the model knows is sampled.
    """
    model = Model(result.model)
    steps = np.radians(np.arange(0.0, 180.0, 30.0)) if model.anisotropic else (0.0,)
    peaks = _peaks(model, result)
    angles = np.concatenate(
        [
            _directions(np.radians(t), p, peaks, way)
            for way in model.ways
            for t in _THETA_I_DEG
            for p in steps
        ],
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


@dataclass(frozen=True)
class _Peak:
    """Rings around the axis ``(c_xy x, c_xy y, z)`` of a source ``(x, y, z)``, or around
    the normal as half vector of the detector and that axis; with ``eta`` around the
    normal as half vector of refraction."""

    width: float
    c_xy: float
    half_vector: bool
    eta: float = 0.0


def _peaks(model: Model, result: FitResult) -> list[_Peak]:
    """Where the lobes peak, with the least width of all channels."""
    found: list[_Peak] = []
    values = {p.name: np.atleast_1d(p.value) for p in result.parameters}
    channels = max(v.size for v in values.values())
    with jax.enable_x64(True):
        for i, lobe in enumerate(model.lobes):
            for c in range(channels):
                own = {n: jnp.asarray(v[min(c, v.size - 1)]) for n, v in values.items()}
                peak = lobe.peak(model.of_lobe(i, own))
                inner = lobe.inner if isinstance(lobe, TurnedOver) else lobe
                turn = -1.0 if isinstance(inner, Retro) else 1.0
                passage = lobe.passage(model.of_lobe(i, own))
                if passage is not None and passage.eta is not None:
                    width = float(min(passage.widths.alpha_x, passage.widths.alpha_y))
                    # A lobe turned over has its dense side in front.
                    eta = 1.0 / passage.eta if inner is not lobe else passage.eta
                    found.append(_Peak(width, turn, True, round(float(eta), 6)))
                if isinstance(peak, AxisPeak):
                    width = float(np.sqrt(2.0 / (peak.exponent + 2.0)))
                    axis = turn * float(peak.c_xy / peak.c_z)
                    found.append(_Peak(width, axis, half_vector=False))
                elif peak is not None:
                    width = float(min(peak.alpha_x, peak.alpha_y))
                    found.append(_Peak(width, turn, half_vector=True))
    kinds: dict[tuple, _Peak] = {}
    for p in sorted(found, key=lambda p: -p.width):
        kinds[p.c_xy, p.half_vector, p.eta] = p
    return [kinds[kind] for kind in sorted(kinds)]


def _directions(theta_i: float, phi_i: float, peaks: list[_Peak], way: Way) -> np.ndarray:
    """``theta_i, phi_i, theta_r, phi_r (4, n)`` in radians, for one source.

    Made for light from the front, with the detector mirrored into the front.
    """
    around = np.linspace(0.0, np.pi, 9)
    ring_theta, ring_phi = np.meshgrid(
        np.radians(np.linspace(0.0, _LARGEST_THETA_DEG, _RINGS)), around
    )
    detectors = [_unit(ring_theta.ravel(), ring_phi.ravel())]
    for peak in peaks:
        axis = np.array([peak.c_xy * np.sin(theta_i), 0.0, np.cos(theta_i)])
        axis = axis / np.linalg.norm(axis)
        slope, turn = np.meshgrid(
            np.geomspace(min(peak.width, 1.0) / 3.0, 1.0, _AROUND_PEAK), around
        )
        ring = _unit(np.arctan(np.append(0.0, slope)), np.append(0.0, turn))
        if peak.eta:
            if way in THROUGH:
                index = peak.eta if way == "down" else 1.0 / peak.eta
                detectors.append(_refracted(axis, ring, index))
        elif peak.half_vector:
            detectors.append(2.0 * (axis @ ring) * ring - axis[:, None])
        else:
            x, z = axis[0], axis[2]
            tilted = np.array([[z, 0.0, x], [0.0, 1.0, 0.0], [-x, 0.0, z]])
            detectors.append(tilted @ ring)
    x, y, z = np.concatenate(detectors, axis=1)
    theta_r, phi_r = np.arctan2(np.hypot(x, y), z), np.arctan2(y, x)
    seen = theta_r <= np.radians(_LARGEST_THETA_DEG) + 1e-9
    theta_r, phi_r = theta_r[seen], phi_r[seen]
    ones = np.ones_like(theta_r)
    if way in FROM_BACK:
        theta_i = np.pi - theta_i
    if way in ("down", "back"):
        theta_r = np.pi - theta_r
    return np.stack([theta_i * ones, phi_i * ones, theta_r, phi_i + phi_r])


def _refracted(source: np.ndarray, facets: np.ndarray, index: float) -> np.ndarray:
    """Where facets send light into a medium, mirrored to this side; none where they reflect
    all of it."""
    cos_d = source @ facets
    cos_t2 = 1.0 - (1.0 - cos_d) * (1.0 + cos_d) / index**2
    passes = (cos_t2 > 0) & (cos_d > 0)
    cos_d, cos_t2, facets = cos_d[passes], cos_t2[passes], facets[:, passes]
    out = (cos_d / index - np.sqrt(cos_t2)) * facets - source[:, None] / index
    out[2] = -out[2]
    return out[:, out[2] > 0]


def _unit(theta: np.ndarray, phi: np.ndarray) -> np.ndarray:
    return np.stack(
        [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)]
    )
