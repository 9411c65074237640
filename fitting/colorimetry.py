"""Colours of surfaces from spectra of reflectance or transmittance factors.

Tables, CIELAB and CIEDE2000 are colour-science's, which is imported when first needed.
"""

from __future__ import annotations

import difflib
import warnings
from collections.abc import Iterable, Sequence
from typing import Any, Literal, NamedTuple

import msgspec
import numpy as np
from numpy.typing import ArrayLike

from fitting.expression import ModelError

ILLUMINANT = "D65"
OBSERVER = "CIE 1931 2 Degree Standard Observer"
VISIBLE_NM = (380.0, 780.0)
FEWEST_WAVELENGTHS = 5

Interpolation = Literal["cubic", "linear"]
Extrapolation = Literal["constant", "none"]
Triple = tuple[float, float, float]

_POINTS, _EXTENDS = {"linear": 2, "cubic": 4}, {"constant": True, "none": False}
_TEN = "CIE 1964 10 Degree Standard Observer"
_ALIASES = dict.fromkeys(("2", "2deg", "2degree", "cie1931", "cie21931"), OBSERVER)
_ALIASES |= dict.fromkeys(("10", "10deg", "10degree", "cie1964", "cie101964"), _TEN)


class ColourError(ModelError):
    """An illuminant, observer, spectrum or uncertainty of which no colour can be made."""


class ObjectColour(msgspec.Struct, frozen=True):
    """The colour of a surface under an illuminant, and what it was computed from.

    ``xyz`` is 100 in Y for the perfect diffuser, whose values are ``white``; ``xy`` is null
    for black. ``lab`` is CIELAB relative to that white. ``srgb`` is encoded, adapted to
    that white by Bradford's transform, and not clipped: it leaves [0, 1] where
    ``srgb_in_gamut`` is false, and ``srgb_clipped`` is what a screen would show.
    ``luminous_reflectance`` is Y / 100 (or the luminous transmittance). Uncertainties
    (k = 1) are of the measured values only, not of what lies between or outside of their
    wavelengths; null if none were given.

    ``range_nm`` are the wavelengths that count, ``interval_nm`` the largest distance of
    neighbours, ``summed_nm, step_nm`` those of the sum, ``weight_outside`` the share, 0..1,
    outside of ``range_nm``, the largest of X, Y and Z. Null for bands: see ``assumption``.
    """

    illuminant: str
    observer: str
    white: Triple
    xyz: Triple
    xy: tuple[float, float] | None
    lab: Triple
    srgb: Triple
    srgb_in_gamut: bool
    srgb_clipped: Triple
    luminous_reflectance: float
    xyz_uncertainty: Triple | None = None
    lab_uncertainty: Triple | None = None
    luminous_reflectance_uncertainty: float | None = None
    range_nm: tuple[float, float] | None = None
    interval_nm: float | None = None
    summed_nm: tuple[float, float] | None = None
    step_nm: float | None = None
    interpolation: Interpolation | None = None
    extrapolation: Extrapolation | None = None
    weight_outside: float | None = None
    assumption: str | None = None


class TristimulusWeights(NamedTuple):
    """``XYZ = factors @ matrix (c, 3)``; ``white (3,)``; the rest as in `ObjectColour`."""

    matrix: np.ndarray
    white: np.ndarray
    illuminant: str
    observer: str
    summed_nm: tuple[float, float]
    outside: float


def colour_of(
    wavelengths_nm: ArrayLike, spectrum: ArrayLike, *,
    sigma: ArrayLike | None = None, correlated: bool = False,
    covariance: ArrayLike | None = None,
    illuminant: str = ILLUMINANT, observer: str = OBSERVER,
    interpolation: Interpolation = "cubic", extrapolation: Extrapolation = "constant",
) -> ObjectColour | None:  # fmt: skip
    """Colour of a spectrum of reflectance or transmittance factors (1 is the diffuser's).

    ``X = 100 sum(R S xbar) / sum(S ybar)`` in steps of 1 nm (CIE 15:2018), see
    `tristimulus_weights`. ``wavelengths_nm, spectrum (c,)`` in any order; what is not
    finite is not measured. ``sigma (c,)`` (k = 1) are independent or, if ``correlated``, of
    one cause; or give ``covariance (c, c)``. XYZ has ``W^T C W``, L*a*b* its Jacobian's.

    None with fewer than five wavelengths in 380 to 780 nm. Raises `ColourError`.
    """
    w, r = (np.asarray(a, dtype=np.float64) for a in (wavelengths_nm, spectrum))
    if w.ndim != 1 or w.shape != r.shape:
        raise ColourError(f"spectrum: found {r.shape} values at {w.shape} wavelengths")
    cov = _covariance(w.size, sigma, correlated, covariance)
    order = np.argsort(w)
    order = order[np.isfinite(r[order]) & np.isfinite(w[order])]
    w, r = w[order], r[order]
    if np.sum((w >= VISIBLE_NM[0]) & (w <= VISIBLE_NM[1])) < FEWEST_WAVELENGTHS:
        return None
    weights = tristimulus_weights(
        w, illuminant=illuminant, observer=observer,
        interpolation=interpolation, extrapolation=extrapolation,
    )  # fmt: skip
    matrix = weights.matrix
    seen = w[np.any(matrix != 0, axis=1)]
    return _colour(
        r @ matrix, weights.white,
        None if cov is None else matrix.T @ cov[np.ix_(order, order)] @ matrix,
        illuminant=weights.illuminant, observer=weights.observer,
        range_nm=(float(seen[0]), float(seen[-1])), interval_nm=float(np.diff(seen).max()),
        summed_nm=weights.summed_nm, step_nm=1.0, weight_outside=weights.outside,
        interpolation=interpolation, extrapolation=extrapolation,
    )  # fmt: skip


def rgb_colour(
    names: Sequence[str], values: ArrayLike, *, sigma: ArrayLike | None = None
) -> ObjectColour | None:
    """Colour of factors ``(3,)`` in named bands: R, G, B or X, Y, Z, in any order.

    What they are taken for is in ``assumption``; ``sigma (3,)`` are independent. None for
    others: of a single band (mono) no luminous reflectance follows. Raises `ColourError`.
    """
    upper = [n.upper() for n in names]
    if sorted(upper) not in (["B", "G", "R"], ["X", "Y", "Z"]):
        return None
    r = np.asarray(values, dtype=np.float64)
    if r.shape != (3,) or not np.all(np.isfinite(r)):
        raise ColourError(f"bands {', '.join(names)}: expected three finite numbers")
    to_xyz = primaries = srgb_to_xyz()
    bands, assumption = "RGB", "R, G, B are taken as linear values of the sRGB primaries"
    if "X" in upper:
        bands, to_xyz = "XYZ", 100.0 * np.eye(3)
        assumption = "X, Y, Z are taken for D65 and the 2 degree observer, Y = 1 for white"
    to_xyz = to_xyz[:, [bands.index(n) for n in upper]]
    cov = _covariance(3, sigma)
    return _colour(
        to_xyz @ r, primaries.sum(axis=1), None if cov is None else to_xyz @ cov @ to_xyz.T,
        illuminant=ILLUMINANT, observer=OBSERVER, assumption=assumption,
    )  # fmt: skip


def delta_e_2000(lab1: ArrayLike, lab2: ArrayLike) -> np.ndarray:
    """CIEDE2000 of L*a*b* ``(..., 3)``, with unit factors k (ISO/CIE 11664-6)."""
    first, second = (np.asarray(a, dtype=np.float64) for a in (lab1, lab2))
    return np.asarray(colour_science().delta_E(first, second, method="CIE 2000"))


def tristimulus_weights(
    wavelengths_nm: np.ndarray, *, illuminant: str = ILLUMINANT, observer: str = OBSERVER,
    interpolation: Interpolation = "cubic", extrapolation: Extrapolation = "constant",
    step_nm: float = 1.0, range_nm: tuple[float, float] = (0.0, np.inf),
) -> TristimulusWeights:  # fmt: skip
    """Weights of values at ascending wavelengths ``(c,)``, normalised to 100 in Y.

    The sum is over the range of both tables, within ``range_nm``. Between wavelengths a
    spectrum is linear or the cubic through the four nearest (Lagrange's, as in ASTM E2022);
    outside it keeps its last value (CIE 15:2018), or, with ``none``, the sum ends and white
    is relative to the same range. Raises `ColourError`.
    """
    w = np.asarray(wavelengths_nm, dtype=np.float64)
    if w.size < 4 or np.any(np.diff(w) <= 0):
        raise ColourError("wavelengths: expected at least four different ones, ascending")
    colour = colour_science()
    source_name = known_name("illuminant", illuminant, colour.SDS_ILLUMINANTS)
    observer_name = known_name("observer", observer, colour.MSDS_CMFS)
    cmfs, source = colour.MSDS_CMFS[observer_name], colour.SDS_ILLUMINANTS[source_name]
    if "x_bar" not in cmfs.signals:
        known = f"it has {', '.join(cmfs.signals)}; use for instance {OBSERVER!r}"
        raise ColourError(f"observer {observer!r} gives no XYZ: {known}")
    low = max(cmfs.wavelengths[0], source.wavelengths[0], range_nm[0])
    high = min(cmfs.wavelengths[-1], source.wavelengths[-1], range_nm[1])
    grid = np.arange(np.ceil(low / step_nm) * step_nm, high + 1e-9, step_nm)
    table = np.stack([np.interp(grid, cmfs.wavelengths, v) for v in cmfs.values.T], axis=1)
    table = table * np.interp(grid, source.wavelengths, source.values)[:, None]
    inside = (grid >= w[0] - 1e-9) & (grid <= w[-1] + 1e-9)
    if not inside.any():
        raise ColourError(f"wavelengths: expected some in {low:g} to {high:g} nm")
    outside = np.max(table[~inside].sum(axis=0) / table.sum(axis=0))
    if not _EXTENDS[extrapolation]:
        grid, table = grid[inside], table[inside]
    table = 100.0 * table / table[:, 1].sum()
    basis = _lagrange(w, np.clip(grid, w[0], w[-1]), _POINTS[interpolation])
    return TristimulusWeights(
        basis.T @ table, table.sum(axis=0), source_name, observer_name,
        (float(grid[0]), float(grid[-1])), float(outside),
    )  # fmt: skip


def colour_science() -> Any:
    """The package ``colour``, imported without its words on plots, which are not used."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import colour
    return colour


def _colour(
    xyz: np.ndarray, white: np.ndarray, cov: np.ndarray | None, **context: Any
) -> ObjectColour:
    colour, primaries, total = colour_science(), srgb_to_xyz(), float(xyz.sum())
    adaptation = colour.adaptation.matrix_chromatic_adaptation_VonKries
    adapt = adaptation(white, primaries.sum(axis=1), transform="Bradford")
    linear = np.linalg.solve(primaries, adapt @ xyz)
    encoded = colour.cctf_encoding(linear, function="sRGB")
    if cov is not None:
        # CIE 15:2018: a cube root down to (6/29)^3, a line below.
        t = np.maximum(xyz / white, (6 / 29) ** 3)
        jacobian = np.array([[0, 116, 0], [500, -500, 0], [0, 200, -200]])
        jacobian = jacobian * (t ** (-2 / 3) / (3 * white))
        both = (np.diag(c) for c in (cov, jacobian @ cov @ jacobian.T))
        of_xyz, of_lab = (_triple(np.sqrt(np.maximum(v, 0.0))) for v in both)
        context |= {"xyz_uncertainty": of_xyz, "lab_uncertainty": of_lab}
        context["luminous_reflectance_uncertainty"] = of_xyz[1] / 100.0
    return ObjectColour(
        white=_triple(white), xyz=_triple(xyz),
        xy=(float(xyz[0]) / total, float(xyz[1]) / total) if total > 0 else None,
        lab=_triple(colour.XYZ_to_Lab(xyz / 100.0, white[:2] / white.sum())),
        srgb=_triple(encoded), srgb_clipped=_triple(np.clip(encoded, 0.0, 1.0)),
        # White itself is at 1 but for rounding.
        srgb_in_gamut=bool(np.all((linear > -1e-9) & (linear < 1 + 1e-9))),
        luminous_reflectance=float(xyz[1]) / 100.0, **context,
    )  # fmt: skip


def _covariance(
    size: int, sigma: ArrayLike | None, correlated: bool = False, given: Any = None
) -> np.ndarray | None:
    if sigma is None and given is None:
        return None
    if sigma is not None and given is not None:
        raise ColourError("uncertainty: found sigma and covariance; give one of them")
    if sigma is not None:
        s = np.asarray(sigma, dtype=np.float64)
        if s.shape != (size,) or not np.all((s >= 0) & np.isfinite(s)):
            raise ColourError(f"sigma: expected {size} finite numbers, none below 0")
        return np.outer(s, s) if correlated else np.diag(s**2)
    c = np.asarray(given, dtype=np.float64)
    square = c.shape == (size, size) and np.allclose(c, c.T, rtol=1e-6, atol=0)
    values = np.linalg.eigvalsh(c) if square else np.array([-1.0])
    if values[0] < -1e-9 * abs(values[-1]):
        wanted = f"{size} x {size}, symmetric, finite, no eigenvalue below 0"
        raise ColourError(f"covariance: found shape {c.shape}; expected {wanted}")
    return c


def known_name(kind: str, name: str, names: Iterable[str]) -> str:
    """The table's spelling of a name, whatever its blanks, hyphens, case; `ColourError`."""
    spelling = {_plain(n): n for n in names if "_" not in n}
    listed = ", ".join(spelling.values())
    if kind == "observer":
        spelling |= _ALIASES
    if _plain(name) in spelling:
        return spelling[_plain(name)]
    near = difflib.get_close_matches(_plain(name), spelling, n=3, cutoff=0.5)
    close = " or ".join(repr(n) for n in dict.fromkeys(spelling[n] for n in near))
    hint = f"did you mean {close}?" if near else f"known: {listed}"
    raise ColourError(f"there is no {kind} {name!r}; {hint}")


def _plain(name: str) -> str:
    return "".join(c for c in name.casefold() if c.isalnum() or c == ".")


def srgb_to_xyz() -> np.ndarray:
    """Columns are the sRGB primaries, 100 in Y for white (IEC 61966-2-1, unrounded)."""
    colour = colour_science()
    space = colour.RGB_COLOURSPACES["sRGB"]
    return 100.0 * colour.normalised_primary_matrix(space.primaries, space.whitepoint)


def _lagrange(w: np.ndarray, x: np.ndarray, points: int) -> np.ndarray:
    """Polynomials through as many wavelengths around each x, ``(x, c)``."""
    first = np.searchsorted(w, x, side="right") - points // 2
    columns = np.clip(first, 0, w.size - points)[:, None] + np.arange(points)
    out, nodes = np.zeros((x.size, w.size)), w[columns]
    for k in range(points):
        others = np.delete(nodes, k, axis=1)
        ratio = (x[:, None] - others) / (nodes[:, k : k + 1] - others)
        out[np.arange(x.size), columns[:, k]] = ratio.prod(axis=1)
    return out


def _triple(values: np.ndarray) -> Triple:
    x, y, z = (float(v) for v in values)
    return x, y, z
