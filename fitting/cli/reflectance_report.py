"""The tables of ``brdf reflectance``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fitting.cli.flags import Flags
from fitting.cli.reflectance_run import Line, Report
from fitting.cli.terminal import bullet, heading, table
from fitting.colorimetry import ObjectColour
from fitting.quantities import (
    channel_span,
    number,
    percent,
    shown_channels,
    with_uncertainty,
)

if TYPE_CHECKING:
    from rich.console import Console


def show(out: Console, report: Report, flags: Flags) -> None:
    """Everything for people."""
    names = report.quantities[0].reflectance.channels if report.quantities else []
    what = f"{report.model} of {report.source}" if report.model else report.source
    how = "fitted model" if report.model else "the measurement itself, nothing is fitted"
    out.print(f"{what}: {channel_span(names)}; {how}", style="bold")
    _summary(out, report)
    if flags.quiet:
        return
    _channels(out, report, flags.verbose)
    _said(out, report)


def _summary(out: Console, report: Report) -> None:
    coloured = any(line.colour is not None for line in report.quantities)
    columns = ["geometry", "mean factor"]
    if coloured:
        columns = ["geometry", "Y/100", "L*", "a*", "b*", "sRGB"]
    compared = any(line.delta_e_2000 is not None for line in report.quantities)
    rows = table(*columns, *(["dE2000"] if compared else []))
    for line in report.quantities:
        factor = line.reflectance.factor
        cells = [line.geometry, number(sum(factor) / len(factor))]
        if coloured:
            cells = [line.geometry, *_colour_cells(line.colour)]
        if compared:
            cells.append(number(line.delta_e_2000, 3))
        rows.add_row(*cells)
    out.print(rows)


def _colour_cells(colour: ObjectColour | None) -> list[str]:
    if colour is None:
        return ["-"] * 5
    lab_sd = colour.lab_uncertainty or (None,) * 3
    luminous = with_uncertainty(
        colour.luminous_reflectance, colour.luminous_reflectance_uncertainty
    )
    lab = [with_uncertainty(v, s) for v, s in zip(colour.lab, lab_sd, strict=True)]
    screen = "".join(f"{round(255 * v):02x}" for v in colour.srgb_clipped)
    return [luminous, *lab, f"#{screen}" + ("" if colour.srgb_in_gamut else " (clipped)")]


def _channels(out: Console, report: Report, everything: bool) -> None:
    if not report.quantities:
        return
    through = [line.reflectance.transmitted for line in report.quantities]
    of = "Transmittance" if all(through) else "Reflectance"
    if any(through) and not all(through):
        of = "Reflectance and transmittance (T)"
    out.print(heading(f"{of} factors by channel"))
    rows = table("channel", *(line.geometry for line in report.quantities))
    names = report.quantities[0].reflectance.channels
    for c in shown_channels(len(names), everything):
        rows.add_row(names[c], *(_factor(line, c) for line in report.quantities))
    out.print(rows)


def _factor(line: Line, c: int) -> str:
    sd = line.reflectance.factor_uncertainty
    return with_uncertainty(line.reflectance.factor[c], None if sd is None else sd[c])


def _said(out: Console, report: Report) -> None:
    for line in report.quantities:
        found = line.reflectance
        way = "transmittance" if found.transmitted else "reflectance"
        bullet(
            out,
            f"{line.geometry}: {found.name} {way}, light from the {found.side}; "
            f"{found.incident} -> {found.collected}; {line.says}",
        )
        for sentence in found.notes:
            bullet(out, f"{line.geometry}: {sentence}")
    worst = max((max(_relative_bounds(line)) for line in report.quantities), default=0.0)
    methods = dict.fromkeys(line.reflectance.method for line in report.quantities)
    for method in methods:
        bullet(out, f"method: {method}")
    if report.model:
        bullet(out, f"error bound of the quadrature: {worst:.1g} of the value at most")
    open_ended = [q.geometry for q in report.quantities if not q.reflectance.converged]
    if open_ended:
        bullet(
            out, f"the quadrature missed its tolerance: {', '.join(open_ended)}", "yellow"
        )
    colour = next((q.colour for q in report.quantities if q.colour is not None), None)
    if colour is None:
        bullet(
            out,
            "no colour: it needs five wavelengths in 380 to 780 nm, or the bands R, G, B",
        )
    else:
        bullet(out, _of_colour(colour))
    _of_uncertainty(out, report)
    for sentence in report.left_out:
        bullet(out, sentence)


def _of_colour(colour: ObjectColour) -> str:
    said = f"colour of the factors under {colour.illuminant}, {colour.observer}"
    if colour.assumption:
        return f"{said}; {colour.assumption}"
    if colour.range_nm and colour.summed_nm:
        said += f"; {colour.range_nm[0]:g} to {colour.range_nm[1]:g} nm"
        said += f", {colour.interpolation} between"
    if colour.weight_outside is not None:
        said += f"; {percent(colour.weight_outside)} of the observer's weight lies outside"
    return said


def _of_uncertainty(out: Console, report: Report) -> None:
    first = report.quantities[0].reflectance if report.quantities else None
    if first is None:
        return
    if first.standard_uncertainty is None:
        why = "no parameter of the fit has one" if report.model else "the file has no sigma"
        bullet(out, f"no uncertainty is known: {why}")
        return
    said = "uncertainties: k = 1"
    if report.model:
        said += ", from the parameters of the fit and their correlations"
    else:
        said += ", of sigma where the file has it, of what is extrapolated, of the sampling"
    if first.without_uncertainty:
        said += f"; without one of their own: {', '.join(first.without_uncertainty)}"
    bullet(out, said)


def _relative_bounds(line: Line) -> list[float]:
    found = line.reflectance
    top = max(abs(v) for v in found.value) or 1.0
    return [b / top for b in found.error_bound]
