"""The README's table of what scenes require: ``python .../scene_table.py DATA``.

DATA is a folder with ``cornell/*.astm`` and ``minidiff/*.astm``, which the project may use
but not ship. Of every file and scene: the model that is kept, its error, what it costs, and
what the model without a second lobe would miss.
"""

from __future__ import annotations

import sys
from pathlib import Path

from data_formats import Measurement, read
from fitting.scene.choice import Choice
from fitting.scene.choose import choose_for_scene
from fitting.scene.load import load_scene
from fitting.scene.reference import Reference
from fitting.scene.stage import set_stage

SCENES = ("studio", "overcast")
SIMPLE = "lambert + ggx"
HEADER = (
    "| file | noise | "
    + " | ".join(f"{s}: kept | off by | `{SIMPLE}` off by" for s in SCENES)
    + " |\n|"
    + "---|" * (2 + 3 * len(SCENES))
)


def files(folder: Path) -> list[str]:
    """The names of the real files, those in R, G, B of a spectral one left out."""
    found = [*folder.glob("cornell/*.astm"), *folder.glob("minidiff/*.astm")]
    names = sorted(str(p.relative_to(folder).with_suffix("")) for p in found)
    return [n for n in names if not n.endswith("_RGB")]


def row(folder: Path, name: str) -> str:
    """One line of the table."""
    m = read(folder / f"{name}.astm")
    reference: Reference | None = None
    cells: list[str] = []
    noise = 0.0
    for scene in SCENES:
        choice, reference, noise = chosen(m, scene, reference)
        kept = choice.candidates[choice.chosen]
        plain = next(
            c for c in choice.candidates if c.model == SIMPLE and not c.per_channel_shape
        )
        shape = ", a shape per channel" if kept.per_channel_shape else ""
        none = "" if choice.met else " (nearest)"
        cells += [f"`{kept.model}`{shape}{none}", f"{choice.error.mean:.2g}"]
        cells += [f"{plain.error.mean:.2g}"]
    return f"| {name} | {noise:.2g} | " + " | ".join(cells) + " |"


def chosen(
    m: Measurement, scene: str, reference: Reference | None
) -> tuple[Choice, Reference, float]:
    """The choice, the interpolated data for the next scene, and their noise in this one."""
    stage = set_stage(m, load_scene(scene), reference=reference)
    choice = choose_for_scene(m, scene, stage=stage)
    return choice, stage.reference, choice.error.noise


def main(folder: Path, names: list[str]) -> None:
    """Print the table, a line at a time."""
    print(HEADER)
    for name in names or files(folder):
        print(row(folder, name), flush=True)


if __name__ == "__main__":
    from fitting.cli import jax_setup

    jax_setup.set_up()
    main(Path(sys.argv[1]), sys.argv[2:])
