"""The answer of `brdf batch`: the files in a table, what failed, where the time went."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from fitting.batch.receipt import Receipt
from fitting.batch.summary import Row
from fitting.batch.summary_files import NAMES
from fitting.cli.batch_run import Ran
from fitting.cli.batch_work import RESULT_NAME
from fitting.cli.terminal import heading, paragraph, table
from fitting.quantities import count, number, percent

_ROWS = 60


def show(out: Console, ran: Ran, folder: Path, who: str, *, total: int, verbose: bool):
    """Print the table of files, the failures and the breakdown of the time."""
    _files(out, [row for row in ran.files if row["status"] == "done"], verbose)
    failed = [r for r in ran.receipts if r.status != "done"]
    if failed:
        out.print(heading("Failed"))
        for receipt in failed[: None if verbose else _ROWS]:
            paragraph(out, f"{receipt.path}: {receipt.reason}", "red")
    out.print()
    paragraph(out, sentence(ran, total))
    if ran.new:
        paragraph(out, times(ran, who))
    paragraph(out, f"written to {folder}: a result per file, {', '.join(NAMES)}")


def sentence(ran: Ran, total: int) -> str:
    """How many files there are, and how they ended."""
    fitted = [row for row in ran.files if row["status"] == "done"]
    loose = sum(not row["converged"] for row in fitted)
    failed, left = len(ran.files) - len(fitted), total - len(ran.files)
    parts = [f"{count(total, 'file')}: {len(fitted)} fitted"]
    parts += [f"{loose} of them did not converge"] if loose else []
    parts += [f"{failed} failed"] if failed else []
    parts += [f"{left} left"] if left else []
    kept = len(ran.receipts) - ran.new
    parts += [f"{kept} were there from before"] if kept else []
    return ", ".join(parts)


def times(ran: Ran, who: str) -> str:
    """Where the time went, of the files that were fitted now."""
    now = _new(ran)
    read, fit, write = (
        sum(getattr(r, name) for r in now) for name in ("read_s", "fit_s", "write_s")
    )
    each = 1e3 * ran.seconds / ran.new
    return (
        f"{ran.seconds:.1f} s by {who}, {each:.0f} ms per file; in the workers: reading "
        f"{read:.1f} s, fitting {fit:.1f} s, writing {write:.1f} s"
    )


def as_json(ran: Ran, total: int) -> str:
    """The rows of the summary, and how many files there are."""
    return json.dumps({"total": total, "files": ran.files}, indent=1, allow_nan=False)


def _new(ran: Ran) -> Sequence[Receipt]:
    # Only receipts of this run know how long writing took.
    return [r for r in ran.receipts if r.write_s]


def _files(out: Console, rows: Sequence[Row], verbose: bool) -> None:
    shown = rows if verbose else rows[:_ROWS]
    if not shown:
        return
    listed = table("file", "model", "typically off", "held-out", "albedo", "", left=2)
    for row in shown:
        off, held = row["typical_deviation"], row["held_out"]
        listed.add_row(
            str(row["result"]).removesuffix(RESULT_NAME.format(name="")),
            str(row["model"]),
            "-" if off is None else percent(float(off)),
            "-" if held is None else number(float(held)),
            f"{row['max_albedo']:.2f}",
            "" if row["converged"] else "not converged",
        )
    out.print(listed)
    if len(shown) < len(rows):
        out.print(f"... and {len(rows) - len(shown)} more; -v lists all")
