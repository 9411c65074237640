"""What is done with one chunk of texels: fitted, and written in one piece."""

from __future__ import annotations

import functools
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

RECIPE = "recipe.json"


@dataclass(frozen=True)
class Chunk:
    """Indices of the first axis, from ``first`` up to ``last``."""

    first: int
    last: int


@dataclass(frozen=True)
class FitTexels:
    """Fits chunks of a file and writes their parts into a folder.

    ``recipe`` is everything that results depend on, as JSON text: the file, the model, the
    settings, the versions. Gives back how many texels there were and how many converged.
    """

    path: Path
    folder: Path
    recipe: str

    def __call__(self, chunk: Chunk) -> tuple[int, int]:
        """Raises ``OSError`` where the part cannot be written."""
        import jax

        from fitting.cli import jax_setup

        jax_setup.set_up()
        from fitting.texels.fits import fit_block, named
        from fitting.texels.target import flat, write_part

        with jax.enable_x64(True):
            source, plan = _common(self.path, self.recipe)
            found = fit_block(plan, *source.read(chunk.first, chunk.last))
            others = ("cost", "converged", "steps", "used", "runner_up")
            arrays = flat(*named(plan, found), {k: found[k] for k in others})
        write_part(self.folder, chunk.first, arrays)
        return found["cost"].shape[0], int(found["converged"].sum())


def settings_of(recipe: str) -> tuple[str, dict[str, Any]]:
    """The model and the arguments of `FitOptions` that a recipe states."""
    said = json.loads(recipe)
    return said["model"], said["settings"]


@functools.lru_cache(maxsize=1)
def _common(path: Path, recipe: str):
    """The file and the plan, once per process. Call with x64 enabled."""
    from fitting.model import Model
    from fitting.texels.fits import plan_of
    from fitting.texels.source import open_source

    model, settings = settings_of(recipe)
    source = open_source(path)
    return source, plan_of(source, Model(model), settings)
