"""The result of a fit: one definition, from which JSON and its schema follow."""

from __future__ import annotations

import json
import math
import os
import tempfile
from pathlib import Path
from typing import Any, Literal

import msgspec
import numpy as np
from numpy.typing import ArrayLike

SCHEMA_VERSION = 1
# What settings call weights that were given row by row; they are not kept.
GIVEN_WEIGHTS = "given"


class ResultError(ValueError):
    """A result file that cannot be read, with what was found and what was expected."""


class Channel(msgspec.Struct, frozen=True):
    """A wavelength or a named band."""

    name: str
    wavelength_nm: float | None


class ParameterResult(msgspec.Struct, frozen=True):
    """One parameter: one value if all channels share it, else one per channel.

    ``standard_uncertainty`` (k = 1) is null where there is none: fixed, at a bound, or not
    determined by the data. ``interval_95`` is value -/+ Student's t times it, with the
    effective degrees of freedom of the variance. ``support`` has null for an infinite end.
    """

    name: str
    kind: str
    unit: str
    meaning: str
    support: tuple[float | None, float | None]
    value: list[float]
    standard_uncertainty: list[float | None]
    interval_95: list[tuple[float, float] | None]
    at_bound: list[bool]
    fixed: bool
    tied_to: str | None


class Correlations(msgspec.Struct, frozen=True):
    """Correlation matrices of the free parameters, one per channel, in order of ``names``.

    Null where a parameter sits at a bound and has no uncertainty.
    """

    names: list[str]
    matrices: list[list[list[float | None]]]


class Scores(msgspec.Struct, frozen=True):
    """Distance of model and data, in every objective, so that results compare.

    ``l2``: RMS over rows of the Euclidean norm over channels of (fit - measured), 1/sr,
    unweighted, without cosine. The others are weighted RMS values per channel and row of
    the objective of that name; ``asinh`` and ``cbrt`` in units of the data's median.
    """

    l2: float
    l2cos: float
    log1p: float
    asinh: float
    cbrt: float
    chi2_reduced: float | None


class AngleError(msgspec.Struct, frozen=True):
    """Errors of the rows of one polar angle of incidence."""

    theta_i_deg: float
    rows: int
    objective: float
    l2: float


class ChannelError(msgspec.Struct, frozen=True):
    """Errors of one channel: RMS in 1/sr, and relative to the RMS of the data.

    Null for a channel without a valid value, or whose values are all zero.
    """

    channel: str
    rms: float | None
    relative_rms: float | None


class CrossValidation(msgspec.Struct, frozen=True):
    """Errors on incidence angles that the fit did not see, each left out in turn.

    ``objective`` is the RMS over all held-out rows, ``typical`` the geometric mean of the
    angles' RMS values, by which models are compared, ``l2`` as in `Scores`; ``scores`` are
    all the objectives over all held-out rows.
    """

    objective: float
    typical: float
    l2: float
    by_angle: list[AngleError]
    scores: Scores | None = None


class Energy(msgspec.Struct, frozen=True):
    """Largest directional albedo of the fit on a dense grid, and what was done about it.

    Of a model with transmission it is what is reflected and transmitted together, for
    light from the ``side``; ``transmitted`` is the transmitted part.
    """

    max_albedo: float
    theta_deg: float
    channel: str
    constraint: str
    weight: float | None
    active: bool
    side: str = "front"
    transmitted: float = 0.0


class Reciprocity(msgspec.Struct, frozen=True):
    """Largest relative difference of f(wi, wo) / n_o^2 and f(wo, wi) / n_i^2 on
    independent pairs, with the indices of the media on both sides."""

    max_relative_difference: float
    by_construction: bool
    weight: float | None


class DataReciprocity(msgspec.Struct, frozen=True):
    """Median relative difference of exchanged directions in the data, by interpolation.

    Of transmitted light it is that of f / n_o^2, with ``relative_index``, the index behind
    the sample relative to the one in front.
    """

    median_relative_difference: float
    pairs: int
    relative_index: float = 1.0


class DataAlbedo(msgspec.Struct, frozen=True):
    """Albedo of the data by summation, for the channel where it is largest, per incidence.

    ``covered`` is the share of the projected hemisphere that the rows stand for. With
    transmitted rows ``albedo`` is the sum of both, and ``transmitted`` the part that goes
    through, over the share ``transmitted_covered``. ``theta_i_deg`` is above 90 for light
    from the back.
    """

    theta_i_deg: float
    albedo: float
    covered: float
    transmitted: float | None = None
    transmitted_covered: float | None = None


class DataNote(msgspec.Struct, frozen=True):
    """What the reader noticed, repaired, masked or guessed."""

    code: str
    sentence: str
    count: int


class Data(msgspec.Struct, frozen=True):
    """Which data were fitted."""

    path: str
    sha256: str
    format: str
    instrument: str
    sample: str
    date: str
    symmetry: str
    rows: int
    rows_used: int
    left_out: list[str]
    notes: list[DataNote]
    reciprocity: DataReciprocity | None
    albedo: list[DataAlbedo]
    reciprocity_transmitted: DataReciprocity | None = None


class Settings(msgspec.Struct, frozen=True):
    """How the fit was asked for, complete enough to repeat it."""

    objective: str
    weights: str
    max_theta_deg: float
    robust: bool
    noise: tuple[float, float] | None
    per_channel_shape: bool
    starts: int
    energy: float | Literal["hard"]
    reciprocity: float
    fix: dict[str, list[float]]
    bounds: dict[str, tuple[float | None, float | None]]
    tie: dict[str, str]
    material: dict[str, str] = {}


class Solver(msgspec.Struct, frozen=True):
    """How the search ended. ``cost`` is the sum of squared residuals."""

    sentence: str
    converged: bool
    cost: float
    steps: int
    starts: int
    starts_agreeing: int
    runner_up_cost_ratio: float | None


class Colour(msgspec.Struct, frozen=True):
    """CIE Delta E 2000 between measured and fitted reflectance factors, row by row."""

    illuminant: str
    observer: str
    range_nm: tuple[float, float]
    mean: float
    percentile_95: float
    maximum: float


class Candidate(msgspec.Struct, frozen=True):
    """One of the models that were fitted to the same data in one go.

    ``error`` and ``held_out`` are those by which they are compared: the RMS of the
    objective (of chi2 the root of its reduced value), and that of angles of incidence that
    were not fitted, as ``typical`` in `CrossValidation`.
    """

    model: str
    parameters: int
    error: float | None
    held_out: float | None
    max_albedo: float
    converged: bool
    kept: bool


class Candidates(msgspec.Struct, frozen=True):
    """All the models, in the order in which they were given, and why one was kept."""

    models: list[Candidate]
    reason: str


class FitResult(msgspec.Struct, frozen=True):
    """Everything that a fit says about a surface, as plain data.

    ``typical_deviation`` is the median relative difference of fit and data, both averaged
    over channels; ``candidates`` are null for a fit on its own.
    `evaluate` computes the BRDF anew; `save` and `load_result` are a lossless round trip.
    """

    schema_version: int
    model: str
    channels: list[Channel]
    parameters: list[ParameterResult]
    uncertainty_method: str
    correlations: Correlations
    identifiability: list[str]
    settings: Settings
    scores: Scores
    by_angle: list[AngleError]
    by_channel: list[ChannelError]
    cross_validation: CrossValidation | None
    energy: Energy
    reciprocity: Reciprocity
    colour: Colour | None
    solver: Solver
    data: Data
    versions: dict[str, str]
    references: list[str]
    typical_deviation: float | None = None
    candidates: Candidates | None = None

    def __str__(self) -> str:
        from fitting.describe import describe

        return describe(self)

    @property
    def values(self) -> dict[str, np.ndarray]:
        """Parameters by name, as `fitting.Model` takes them."""
        out: dict[str, np.ndarray] = {}
        for p in self.parameters:
            value = np.asarray(p.value)
            shared = p.kind == "shape" and value.size == 1
            out[p.name] = value[0] if shared else value
        return out

    def parameter(self, name: str) -> ParameterResult:
        """The parameter of that name; raises ``KeyError``."""
        for p in self.parameters:
            if p.name == name:
                return p
        raise KeyError(name)

    def evaluate(
        self, theta_i: ArrayLike, phi_i: ArrayLike, theta_r: ArrayLike, phi_r: ArrayLike
    ) -> np.ndarray:
        """BRDF ``(n, c)`` in 1/sr at angles in radians, in float64."""
        from fitting.predict import predict

        return predict(self.model, self.values, theta_i, phi_i, theta_r, phi_r)

    def to_json(self) -> str:
        """JSON with full precision; raises `ResultError` if a number is not finite."""
        plain = msgspec.to_builtins(self)
        _refuse_nonfinite(plain, "result")
        return json.dumps(plain, indent=1, allow_nan=False)

    def save(self, path: str | os.PathLike) -> None:
        """Write JSON beside the target and rename it, so that no half file is left."""
        target = Path(path)
        text = self.to_json()
        handle, beside = tempfile.mkstemp(dir=target.parent or ".", prefix=target.name)
        try:
            with os.fdopen(handle, "w", encoding="utf-8") as file:
                file.write(text + "\n")
            os.chmod(beside, 0o666 & ~_umask())
            os.replace(beside, target)
        except BaseException:
            Path(beside).unlink(missing_ok=True)
            raise


def load_result(path: str | os.PathLike) -> FitResult:
    """Read a result that `FitResult.save` wrote. Raises `ResultError` in one sentence."""
    try:
        raw = Path(path).read_bytes()
    except OSError as error:
        raise ResultError(
            f"{path}: {error.strerror or error}; expected a result"
        ) from error
    try:
        plain = json.loads(raw)
    except (ValueError, RecursionError) as error:
        raise ResultError(
            f"{path}: not JSON ({error}); expected a result of `brdf fit`"
        ) from error
    version = plain.get("schema_version") if isinstance(plain, dict) else None
    if version != SCHEMA_VERSION:
        raise ResultError(
            f"{path}: schema_version is {version!r}; expected {SCHEMA_VERSION}, a result "
            "of `brdf fit`"
        )
    try:
        return msgspec.convert(plain, FitResult)
    except msgspec.ValidationError as error:
        raise ResultError(f"{path}: {error}; expected a result of `brdf fit`") from error


def json_schema() -> dict[str, Any]:
    """The JSON Schema of a result, generated from the definition above."""
    schema = msgspec.json.schema(FitResult)
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Result of a BRDF fit",
        **schema,
    }


def finite_or_none(value: float) -> float | None:
    """The number, or None where JSON would have none for it."""
    return float(value) if math.isfinite(value) else None


def _refuse_nonfinite(value: Any, where: str) -> None:
    if isinstance(value, float) and not math.isfinite(value):
        raise ResultError(f"{where} is {value}, which JSON cannot hold; please report this")
    if isinstance(value, dict):
        for key, item in value.items():
            _refuse_nonfinite(item, f"{where}.{key}")
    elif isinstance(value, list | tuple):
        for i, item in enumerate(value):
            _refuse_nonfinite(item, f"{where}[{i}]")


def _umask() -> int:
    current = os.umask(0)
    os.umask(current)
    return current
