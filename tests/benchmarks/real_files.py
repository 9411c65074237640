"""The README's table of fits to real files: ``python tests/benchmarks/real_files.py DATA``.

DATA is a folder with ``cornell/*.astm`` and ``minidiff/*.astm``, which the project may use
but not ship. "Others" are the best figures of other programs on the same files, with the
model they used.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

from data_formats import read
from fitting import compare, fit


@dataclass(frozen=True)
class Reference:
    """The best figure of another program for a file, as L2, and what it was made with."""

    l2: float
    by: str


OTHERS = {
    "cornell/garnet_red_RGB": Reference(0.0129, "scipy, Lambert + GGX"),
    "cornell/krylon_blue_RGB": Reference(0.0677, "scipy, Lambert + GGX"),
    "cornell/garnet_red": Reference(0.2106, "scipy, Lambert + GGX"),
    "cornell/krylon_blue": Reference(0.5176, "scipy, Lambert + GGX"),
    "minidiff/C10_Copper": Reference(0.1779, "2 GGX, shape per channel"),
    "minidiff/C2_Black": Reference(0.6107, "2 GGX, shape per channel"),
    "minidiff/C8_Silver": Reference(0.1133, "2 GGX, shape per channel"),
    "minidiff/Metal_Blue": Reference(0.1025, "ALTA, Beckmann without 1/(cos cos)"),
    "minidiff/Metal_Red": Reference(0.3808, "ALTA, Beckmann without 1/(cos cos)"),
}
MODELS = (
    "lambert + ggx",
    "lambert + ggx(bare)",
    "lambert + 2*ggx",
    "lambert + ggx + blinn_phong",
)
HEADER = (
    "| file | rows x channels | default command keeps | its L2 | L2 of "
    + " | ".join(f"`{m}`" for m in MODELS)
    + " | best of others |\n|"
    + "---|" * (5 + len(MODELS))
)


def row(folder: Path, name: str) -> str:
    """One line of the table; `MODELS` are fitted with ``--objective l2``."""
    m = read(folder / f"{name}.astm")
    kept = compare(m)
    best = kept.results[kept.best]
    l2 = [fit(m, model, objective="l2", cross_validate=False).scores.l2 for model in MODELS]
    other = OTHERS.get(name)
    theirs = f"{other.l2:.4f} ({other.by})" if other else ""
    return (
        f"| {name} | {int(m.valid.any(axis=1).sum())} x {m.n_channels} | `{best.model}` | "
        f"{best.scores.l2:.4f} | " + " | ".join(f"{v:.4f}" for v in l2) + f" | {theirs} |"
    )


def names(folder: Path) -> list[str]:
    """All files of the two instruments, in order."""
    found = [
        *sorted(folder.glob("cornell/*.astm")),
        *sorted(folder.glob("minidiff/*.astm")),
    ]
    return [f"{path.parent.name}/{path.stem}" for path in found]


def main() -> None:
    folder = Path(sys.argv[1])
    print(HEADER)
    for name in names(folder):
        print(row(folder, name), flush=True)


if __name__ == "__main__":
    main()
