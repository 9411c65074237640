"""The result beside other models: those of the same run, and other results given."""

from __future__ import annotations

from collections.abc import Sequence

from fitting.comparison import candidate
from fitting.quantities import number
from fitting.report.blocks import Block, Table, Words
from fitting.report.reported import Reported
from fitting.result import Candidate


def blocks(every: Sequence[Reported]) -> list[Block]:
    """A table of the models of the run, and one of the results of this report."""
    first = every[0].result
    out: list[Block] = []
    if first.candidates is not None:
        models = first.candidates.models
        kept = [m.kept for m in models]
        objective = first.settings.objective
        title = f"Models fitted to these data in the same run ({objective})"
        columns = ("model", "parameters", "error", "held-out", "largest albedo", "remark")
        rows = [(*_figures(m), _remark(m)) for m in models]
        out.append(
            Table(
                "candidates", title, columns, rows, ("remark",),
                marked=kept.index(True) if any(kept) else None,
            )
        )  # fmt: skip
        out.append(Words(f"Kept: {first.candidates.reason}."))
    if len(every) > 1:
        out += _results(every)
    if not out:
        out.append(
            Words(
                "This model was fitted on its own; brdf fit without -m compares common "
                "models, and further results may be given to brdf report."
            )
        )
    return out


def _results(every: Sequence[Reported]) -> list[Block]:
    rows = []
    for one in every:
        r = one.result
        name, parameters, error, unseen, albedo = _figures(candidate(r, kept=False))
        rows.append(
            (one.file or r.data.path, name, parameters, r.settings.objective, error, unseen,
             number(r.scores.l2), "-" if r.colour is None else f"{r.colour.mean:.2f}",
             albedo)
        )  # fmt: skip
    columns = (
        "result", "model", "parameters", "objective", "error", "held-out", "l2 / (1/sr)",
        "mean CIEDE2000", "largest albedo",
    )  # fmt: skip
    title = "Results of this report, the first of which is told in full"
    out: list[Block] = [Table("results", title, columns, rows, ("model", "objective"))]
    if len({r.result.data.sha256 for r in every}) > 1:
        out.append(Words("They are of different data: their errors do not compare."))
    elif len({r.result.data.rows_used for r in every}) > 1:
        out.append(Words("They use different rows of the data: errors hardly compare."))
    elif len({r.result.settings.objective for r in every}) > 1:
        out.append(Words("They make different objectives small; compare them by l2."))
    return out


def _figures(c: Candidate) -> tuple[str, str, str, str, str]:
    return (
        c.model, str(c.parameters), number(c.error, 3), number(c.held_out, 3),
        f"{c.max_albedo:.2f}",
    )  # fmt: skip


def _remark(c: Candidate) -> str:
    words = ["kept"] if c.kept else []
    words += [] if c.converged else ["did not converge"]
    return ", ".join(words)
