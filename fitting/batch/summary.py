"""Tables over all files: one row per file, and one per parameter and channel.

Columns are in the units of a result: 1/sr for ``l2``, albedos and relative differences as
numbers, angles in degrees, times in seconds. What is not there is empty, and NaN in HDF5.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec

from fitting.batch.receipt import Receipt
from fitting.result import FitResult, ParameterResult

Row = dict[str, str | float | None]

FILE_COLUMNS = (
    "file", "result", "status", "reason", "model", "converged", "solver", "rows_used",
    "channels", "typical_deviation", "l2", "l2cos", "log1p", "asinh", "cbrt",
    "chi2_reduced", "held_out", "max_albedo", "max_albedo_theta_i_deg",
    "max_albedo_channel", "reciprocity", "data_reciprocity", "data_max_albedo", "sample",
    "data_sha256", "read_s", "fit_s",
)  # fmt: skip
PARAMETER_COLUMNS = (
    "file", "result", "model", "parameter", "unit", "channel", "wavelength_nm", "value",
    "standard_uncertainty", "low_95", "high_95", "at_bound", "fixed",
)  # fmt: skip
TEXT = frozenset(
    ("file", "result", "status", "reason", "model", "solver", "max_albedo_channel",
     "sample", "data_sha256", "parameter", "unit", "channel")
)  # fmt: skip


def tables(
    folder: Path, receipts: Sequence[Receipt], result_name: str
) -> tuple[list[Row], list[Row]]:
    """Rows of files and of parameters, from the results that lie in a folder.

    ``result_name`` has ``{name}`` where the name of the receipt goes.
    """
    files: list[Row] = []
    parameters: list[Row] = []
    for receipt in receipts:
        at = result_name.format(name=receipt.name)
        result = _result(folder / at) if receipt.status == "done" else None
        files.append(_file_row(receipt, at, result))
        if result is not None:
            head: Row = {"file": receipt.path, "result": at, "model": result.model}
            parameters += [
                head | row for p in result.parameters for row in _rows(p, result)
            ]
    return files, parameters


def _result(path: Path) -> FitResult:
    return msgspec.json.decode(path.read_bytes(), type=FitResult)


def _file_row(receipt: Receipt, at: str, result: FitResult | None) -> Row:
    row: Row = dict.fromkeys(FILE_COLUMNS)
    row |= {
        "file": receipt.path,
        "status": receipt.status,
        "reason": receipt.reason,
        "data_sha256": receipt.data_sha256,
        "read_s": receipt.read_s,
        "fit_s": receipt.fit_s,
    }
    if result is None:
        return row
    scores: Mapping[str, float | None] = msgspec.structs.asdict(result.scores)
    data, energy, held_out = result.data, result.energy, result.cross_validation
    measured = data.reciprocity
    own = None if measured is None else measured.median_relative_difference
    return row | scores | {
        "result": at,
        "model": result.model,
        "converged": float(result.solver.converged),
        "solver": result.solver.sentence,
        "rows_used": data.rows_used,
        "channels": len(result.channels),
        "typical_deviation": result.typical_deviation,
        "held_out": None if held_out is None else held_out.objective,
        "max_albedo": energy.max_albedo,
        "max_albedo_theta_i_deg": energy.theta_deg,
        "max_albedo_channel": energy.channel,
        "reciprocity": result.reciprocity.max_relative_difference,
        "data_reciprocity": own,
        "data_max_albedo": max((a.albedo for a in data.albedo), default=None),
        "sample": data.sample,
    }  # fmt: skip


def _rows(parameter: ParameterResult, result: FitResult) -> Iterator[Row]:
    """One per value: of a channel, or of all channels together (``channel`` is empty)."""
    p: Any = parameter
    shared = len(p.value) == 1 and (p.kind == "shape" or len(result.channels) > 1)
    channels = [None] if shared else result.channels
    entries = zip(
        channels, p.value, p.standard_uncertainty, p.interval_95, p.at_bound, strict=True
    )
    for channel, value, sigma, interval, at_bound in entries:
        yield {
            "parameter": p.name,
            "unit": p.unit,
            "channel": None if channel is None else channel.name,
            "wavelength_nm": None if channel is None else channel.wavelength_nm,
            "value": value,
            "standard_uncertainty": sigma,
            "low_95": None if interval is None else interval[0],
            "high_95": None if interval is None else interval[1],
            "at_bound": float(at_bound),
            "fixed": float(p.fixed),
        }
