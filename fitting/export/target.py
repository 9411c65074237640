"""The contract of a target, which every file named in the registry fulfils."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from fitting.export.surface import Surface
from fitting.expression import ModelError
from fitting.geometry import Geometry
from fitting.models import Way
from fitting.result import FitResult

Say = Callable[[str], None]


class ExportError(ModelError):
    """An export that makes no sense, or that a target cannot hold, in one sentence."""


@dataclass(frozen=True)
class Request:
    """What a user decides about an export; a target's ``OPTIONS`` name what it heeds.

    - ``representation``: which of its own models the target is given, instead of the one
      that comes closest.
    - ``spectral``: one value per wavelength instead of linear sRGB.
    - ``channels``: names of the fit's channels: those that are taken for R, G and B, or
      the one that a target of a single channel gets.
    - ``illuminant``: of the colour of spectra.
    - ``theta_i, theta_r, phi_r``: angles of a table in degrees; () for the default ones.
    - ``level``: of refinement of a tensor tree.
    """

    representation: str | None = None
    spectral: bool = False
    channels: tuple[str, ...] = ()
    illuminant: str = "D65"
    theta_i: tuple[float, ...] = ()
    theta_r: tuple[float, ...] = ()
    phi_r: tuple[float, ...] = ()
    level: int | None = None


class Representation(Protocol):
    """What a target computes from the file, in the words of this program."""

    @property
    def words(self) -> str: ...

    def __call__(self, geometry: Geometry) -> np.ndarray:
        """BSDF ``(n, c)`` in 1/sr in the channels of the target."""
        ...


@dataclass(frozen=True)
class Product:
    """What a target makes of a fit, before it is written.

    - ``surface``: the fit in the channels of the target.
    - ``representation``: what the target computes, or None where that depends on how the
      program interpolates.
    - ``ways``: of light that the target holds.
    - ``conventions``: how its numbers are meant: alpha or roughness, cosine, colour.
    - ``remarks``: a sentence on everything that was changed or could not be represented.
    - ``write``: writes the file with some lines of comment.
    - ``faithful``: whether the target computes the representation itself, and not
      something near it, which a remark tells.
    """

    surface: Surface
    representation: Representation | None
    ways: tuple[Way, ...]
    conventions: tuple[str, ...]
    remarks: tuple[str, ...]
    write: Callable[[Path, Sequence[str]], None]
    faithful: bool = True


class Target(Protocol):
    """What a target's module has.

    - ``NAME``, ``SUFFIXES``: the first suffix is that of a file without a name.
    - ``OPTIONS``: the fields of `Request` that it heeds.
    - ``REPRESENTATIONS``: the names that ``representation`` may have.
    """

    NAME: str
    SUFFIXES: tuple[str, ...]
    OPTIONS: tuple[str, ...]
    REPRESENTATIONS: tuple[str, ...]

    def make(self, result: FitResult, request: Request, path: Path, say: Say) -> Product:
        """The fit as the target holds it. Raises `ExportError`."""
        ...
