"""What is said about an export: how close it is, and what it could not hold."""

from __future__ import annotations

import msgspec
import numpy as np

from fitting.export.pairs import PAIRS, pairs_of
from fitting.export.surface import Surface
from fitting.export.target import Product, Representation
from fitting.models import Way
from fitting.quantities import percent

# Below this the two are one formula, evaluated with other roundings.
EXACT = 1e-9
# Of the largest value: what is darker is beside a beam and has no relative deviation.
_DARK = 1e-9


class Residual(msgspec.Struct, frozen=True):
    """Distance of the exported from the fitted BSDF, over all pairs of directions.

    ``relative_rms`` is the root of ``int int (g - f)^2 cos_i cos_o`` over that of ``int
    int f^2 cos_i cos_o``, all channels together, up to 85 degrees from the normal; what
    shines at grazing angles decides it. ``relative_rms_log1p`` is the same of ``log(1 + f
    cos_o)``, which the fits make small and by which a target's model is chosen, and
    ``typical`` the median of ``|g / f - 1|`` in the same measure.
    ``largest`` is the largest ``|g - f|`` of ``pairs`` quasi-random pairs, half of them
    around the peaks, in 1/sr, with ``fitted`` and ``exported`` there, the angles in degrees
    and the channel.
    """

    relative_rms: float
    relative_rms_log1p: float
    typical: float
    largest: float
    fitted: float
    exported: float
    theta_i_deg: float
    phi_i_deg: float
    theta_r_deg: float
    phi_r_deg: float
    channel: str
    pairs: int

    @property
    def exact(self) -> bool:
        """Whether the two are the same but for rounding."""
        return self.relative_rms < EXACT

    def __str__(self) -> str:
        if self.exact:
            return "none, it is the formula of the fit"
        across = np.remainder(self.phi_r_deg - self.phi_i_deg, 360.0)
        return (
            f"typically {percent(self.typical)} (median), relative RMS "
            f"{self.relative_rms:.2g} (cosine-weighted, up to 85 deg), of log(1 + f cos) "
            f"{self.relative_rms_log1p:.2g}; largest deviation {self.largest:.3g} per sr "
            f"({self.exported:.4g} for {self.fitted:.4g}, {self.channel}) at theta_i "
            f"{self.theta_i_deg:.1f}, theta_r {self.theta_r_deg:.1f}, phi_r - phi_i "
            f"{across:.1f} deg"
        )


class Report(msgspec.Struct, frozen=True):
    """What was written, and how it stands to the fit.

    ``represented_by`` names what the target computes, ``residual`` its distance from the
    fit, null where that depends on how the target interpolates a table. ``conventions``
    are those of the file's numbers; ``remarks`` say what was changed or left out. ``exact``
    is whether the target computes the fitted model, but for rounding.
    """

    target: str
    file: str | None
    model: str
    represented_by: str
    exact: bool
    residual: Residual | None
    channels: list[str]
    conventions: list[str]
    remarks: list[str]

    def lines(self) -> list[str]:
        """For the comment of the file."""
        out = [
            f"Fitted model: {self.model}",
            f"Represented by: {self.represented_by}",
        ]
        if self.residual is not None:
            out.append(f"Distance from the fit: {self.residual}")
        return [*out, *self.conventions, *self.remarks]


def report_of(target: str, file: str | None, product: Product) -> Report:
    """The report on a product, with its distance from the fit."""
    representation, found = product.representation, None
    if representation is not None:
        found = residual(product.surface, representation, product.ways)
    return Report(
        target=target,
        file=file,
        model=product.surface.result.model,
        represented_by=representation.words if representation else "a table of its values",
        exact=found is not None and found.exact and product.faithful,
        residual=found,
        channels=[c.name for c in product.surface.channels],
        conventions=list(product.conventions),
        remarks=list(product.remarks),
    )


def residual(
    surface: Surface,
    representation: Representation,
    ways: tuple[Way, ...] = ("front",),
    pairs: int = PAIRS,
) -> Residual:
    """How far a representation is from a surface, over some ways of light."""
    at = pairs_of(surface.model, surface.result.values, ways, pairs)
    f, g = surface(at.geometry), representation(at.geometry)
    weight = at.weight[:, None]
    row, channel = np.unravel_index(int(np.argmax(np.abs(g - f))), f.shape)
    q = at.geometry
    angles = [
        float(np.degrees(np.arctan2(a[row], b[row])))
        for a, b in (
            (np.hypot(q.wix, q.wiy), q.cos_i),
            (q.wiy, q.wix),
            (np.hypot(q.wox, q.woy), q.cos_o),
            (q.woy, q.wox),
        )
    ]
    cosine = np.abs(np.asarray(at.geometry.cos_o))[:, None]
    logs = [np.log1p(np.maximum(v, 0.0) * cosine) for v in (f, g)]
    return Residual(
        relative_rms=_relative(weight, f, g),
        relative_rms_log1p=_relative(weight, *logs),
        typical=_median(np.abs(g - f), np.abs(f), weight),
        largest=float(np.abs(g - f)[row, channel]),
        fitted=float(f[row, channel]),
        exported=float(g[row, channel]),
        theta_i_deg=angles[0], phi_i_deg=angles[1],
        theta_r_deg=angles[2], phi_r_deg=angles[3],
        channel=surface.channels[channel].name,
        pairs=len(at.weight),
    )  # fmt: skip


def _relative(weight: np.ndarray, f: np.ndarray, g: np.ndarray) -> float:
    norm = float(np.sum(weight * f * f))
    off = float(np.sum(weight * (g - f) ** 2))
    return float(np.sqrt(off / norm)) if norm > 0 else float(off > 0)


def _median(off: np.ndarray, size: np.ndarray, weight: np.ndarray) -> float:
    """Weighted median of relative deviations, where there is light at all."""
    some = size > _DARK * np.max(size, initial=0.0)
    if not some.any():
        return float(np.max(off, initial=0.0) > 0)
    ratio, w = off[some] / size[some], np.broadcast_to(weight, off.shape)[some]
    order = np.argsort(ratio)
    total = np.cumsum(w[order])
    return float(ratio[order][np.searchsorted(total, 0.5 * total[-1])])
