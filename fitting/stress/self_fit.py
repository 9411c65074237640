"""Whether a lobe finds itself again in data made from it, without noise."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from data_formats import Channel, Measurement
from fitting.fitter import fit
from fitting.geometry import from_angles
from fitting.model import Model
from fitting.models import Way
from fitting.parameters import Parameter
from fitting.predict import predict_geometry
from fitting.result import FitResult, load_result
from fitting.stress.finding import Finding
from fitting.stress.points import Points
from fitting.stress.variants import Variant

PARAMETERS = 1e-4
VALUES = 1e-6
_STARTS = 4
_THETA_I_DEG = (15.0, 40.0, 65.0)
_WAVELENGTHS_NM = (450.0, 650.0)


def self_fit(variant: Variant) -> tuple[Finding, Finding]:
    """A fit to what a goniometer would measure, and its result written and read again.

    Parameters that such data leave open are judged by the values that they predict.
    """
    model = variant.model
    truth = _truth(variant, model)
    angles = _directions(model.anisotropic, model.ways)
    geometry = from_angles(*angles)
    values = predict_geometry(model, truth, geometry).reshape(len(angles[0]), -1)
    known = {
        n: v
        for n, v in truth.items()
        if model.parameters()[n].given and model.parameters()[n].unit != "nm"
    }
    result = fit(
        _measurement(angles, values, model),
        model,
        cross_validate=False,
        starts=_STARTS,
        fix=known,
        # The truth may well reflect more than arrives; energy is a contract of its own.
        energy=0.0,
        reciprocity=0.0,
        max_theta_deg=90.0,
    )
    predicted = predict_geometry(model, result.values, geometry).reshape(values.shape)
    return _recovered(model, result, truth, predicted, values), _round_trip(
        model, result, angles, predicted
    )


def _recovered(
    model: Model,
    result: FitResult,
    truth: dict[str, np.ndarray],
    predicted: np.ndarray,
    values: np.ndarray,
) -> Finding:
    off = float(np.max(np.abs(predicted - values)) / np.max(np.abs(values)))
    missed, worst = [], 0.0
    for name, p in model.parameters().items():
        if p.given:
            continue
        found = np.asarray(result.values[name])
        error = float(np.max(np.abs(_difference(p, found, truth[name]))))
        worst = max(worst, error)
        if error > PARAMETERS:
            missed.append(name)
    ok = off <= VALUES
    if not ok:
        said = f"the fit is off by {off:.2g} of the largest value"
    elif missed:
        said = f"the values agree to {off:.2g}; these data leave open {', '.join(missed)}"
    else:
        said = f"recovers its parameters to {worst:.2g} and its values to {off:.2g}"
    return Finding("self-fit", ok, off, "", said)


def _difference(p: Parameter, found: np.ndarray, truth: np.ndarray) -> np.ndarray:
    difference = found - truth
    if p.scale == "periodic":
        period = p.support[1] - p.support[0]
        return (difference + 0.5 * period) % period - 0.5 * period
    return difference / np.maximum(np.abs(truth), 1e-2)


def _round_trip(
    model: Model, result: FitResult, angles: tuple, predicted: np.ndarray
) -> Finding:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "self.fit.json"
        result.save(path)
        again = load_result(path)
    values = predict_geometry(model, again.values, from_angles(*angles))
    difference = float(np.max(np.abs(values.reshape(predicted.shape) - predicted)))
    ok = again == result and difference == 0.0
    said = "what is read is what was written"
    if not ok:
        said = f"what is read predicts values that differ by {difference:.2g}"
    return Finding("JSON round trip", ok, difference, "", said)


def _truth(variant: Variant, model: Model) -> dict[str, np.ndarray]:
    """Values inside of where fits start, so that no default is the answer."""
    channels = np.arange(len(_WAVELENGTHS_NM))
    out = {}
    for name, p in model.parameters().items():
        if p.given:
            known = np.asarray(_WAVELENGTHS_NM) if p.unit == "nm" else p.default
            out[name] = np.broadcast_to(np.asarray(known, float), channels.shape)
        elif p.coefficient:
            high = p.support[1]
            usual = p.default if 0 < p.default < high else min(0.5, 0.5 * high)
            out[name] = usual * (1.0 - 0.3 * channels)
        else:
            low, high = p.start
            share = 0.55
            inside = low + (high - low) * share
            if p.scale == "log":
                inside = low * (high / low) ** share
            out[name] = np.asarray(inside)
    return out


def _directions(anisotropic: bool, ways: tuple[Way, ...]) -> tuple[np.ndarray, ...]:
    """Rings around the normal for every angle of incidence, finer about the mirror, on
    every way of light."""
    rings = _rings(anisotropic)
    there = Points(*rings, shape={})
    each = [there.along(np.full(rings[0].size, way)) for way in ways]
    return tuple(
        np.concatenate([getattr(p, name) for p in each])
        for name in ("theta_i", "phi_i", "theta_o", "phi_o")
    )


def _rings(anisotropic: bool) -> tuple[np.ndarray, ...]:
    """Of reflected light at the front."""
    rows = []
    phi = np.linspace(0.0, 2 * np.pi if anisotropic else np.pi, 13)[:12]
    for theta_i in np.radians(_THETA_I_DEG):
        rows += [(theta_i, 0.0, t, p) for t in np.radians([5, 25, 45, 62, 78]) for p in phi]
        for off in np.radians([-6.0, -3.0, -1.0, 0.0, 1.0, 3.0, 6.0]):
            for aside in np.radians([0.0, 4.0]):
                rows.append((theta_i, 0.0, theta_i + off, np.pi + aside))
                rows.append((theta_i, 0.0, theta_i + off, aside))
    return tuple(np.array(rows).T)


def _measurement(angles: tuple, values: np.ndarray, model: Model) -> Measurement:
    names = _WAVELENGTHS_NM[: values.shape[1]]
    return Measurement(
        *angles,
        value=values,
        valid=np.ones(values.shape, dtype=bool),
        channels=tuple(Channel(f"{w:g} nm", w) for w in names),
        symmetry="anisotropic" if model.anisotropic else "bilateral",
    )
