"""``brdf info``: what is in a file, before anything is fitted."""

from __future__ import annotations

import json as json_module
import math
import sys
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from fitting.cli.failures import UsageError
from fitting.cli.flags import File, Flags, Format, Json, Reader

if TYPE_CHECKING:
    from rich.console import Console


def info(
    file: File,
    /,
    *,
    json: Json = False,
    format: Format = None,
    reader: Reader = None,
    relative_index: Annotated[
        float,
        Parameter(
            help="Index of the medium behind the sample relative to the one in front, for "
            "the reciprocity of transmitted light."
        ),
    ] = 1.0,
    flags: Flags | None = None,
) -> int:
    """Say what is in a file: geometry, coverage, values, quality."""
    if not 0 < relative_index < math.inf:
        raise UsageError(f"--relative-index {relative_index:g}: expected a number above 0")
    from fitting.cli import assignments, reading

    options = assignments.of_lines("reader", reader or [])
    measurement = reading.read_file(file, format, options)

    from fitting.cli.data_summary import summarise

    summary = summarise(measurement, relative_index)
    if json:
        sys.stdout.write(json_module.dumps(summary, indent=1, allow_nan=False) + "\n")
        return 0
    from fitting.cli.terminal import stdout

    out = stdout()
    out.print(reading.headline(measurement, file), style="bold")
    if not (flags or Flags()).quiet:
        _show(out, summary, (flags or Flags()).verbose)
    return 0


def _show(out: Console, s: dict[str, Any], everything: bool) -> None:
    _origin(out, s, everything)
    _geometry(out, s)
    _values(out, s, everything)
    _quality(out, s)


def _origin(out: Console, s: dict[str, Any], everything: bool) -> None:
    from fitting.cli.terminal import bullet

    for name in ("format", "instrument", "sample", "date"):
        if s[name]:
            bullet(out, f"{name}: {s[name]}")
    if s["auxiliary"]:
        bullet(out, f"further columns: {', '.join(s['auxiliary'])}")
    bullet(out, "standard uncertainties: " + ("yes" if s["has_uncertainty"] else "none"))
    if everything:
        bullet(out, f"sha256: {s['sha256']}")
        for key, text in s["header"].items():
            bullet(out, f"header {key}: {text}")


def _geometry(out: Console, s: dict[str, Any]) -> None:
    from fitting.cli.terminal import heading, table
    from fitting.quantities import count, degrees, percent, valid_share

    out.print(heading("Geometry, by angle of incidence"))
    through = any(i["transmitted"] for i in s["incidence"])
    rows = table(
        "theta_i", "rows", "valid", "theta_r", "steps up to", "azimuth", "mirror", "retro",
        "albedo", "covered",
    )  # fmt: skip
    for line in _few(s["incidence"]):
        if line is None:
            rows.add_row("...")
            continue
        rows.add_row(
            degrees(line["theta_i_deg"]) + (" R", " T")[line["transmitted"]] * through,
            str(line["rows"]),
            valid_share(line["valid"]),
            _range(line["theta_r_deg"]),
            _rounded(line["largest_step_deg"], 1),
            _range(line["azimuth_deg"]),
            _rounded(line["nearest_to_mirror_deg"], 1),
            _rounded(line["nearest_to_retro_deg"], 1),
            _rounded(line["albedo"], 3),
            "-" if line["covered"] is None else percent(line["covered"]),
        )
    out.print(rows)
    out.print(
        "angles in deg; azimuth of the detector from the source's (180: mirror side); "
        "mirror, retro: distance of these directions to the nearest valid row; albedo of "
        "the largest channel by summation over the covered share of the hemisphere"
        + (
            "; R: reflected, T: transmitted, straight on counts as mirror"
            if through
            else ""
        ),
        style="dim",
    )
    inside, total = s["rows_in_plane"], s["rows"]
    where = "all" if inside == total else f"{inside} of {count(total, 'row')}"
    out.print(f"in the plane of incidence: {where}; symmetry: {s['symmetry']}")
    if s["rows_transmitted"]:
        out.print(f"transmitted light: {count(s['rows_transmitted'], 'row')}")
    if s["rows_from_back"]:
        out.print(
            f"lit from the back (theta_i > 90 deg): {count(s['rows_from_back'], 'row')}"
        )


def _values(out: Console, s: dict[str, Any], everything: bool) -> None:
    from fitting.cli.terminal import heading, table
    from fitting.quantities import number, shown_channels, valid_share

    out.print(heading("Values, 1/sr, without cosine"))
    rows = table("channel", "valid", "minimum", "median", "maximum")
    shown = shown_channels(len(s["channels"]), everything)
    for c in shown:
        line = s["channels"][c]
        rows.add_row(
            line["name"],
            valid_share(line["valid"]),
            *(number(line[k]) for k in ("minimum", "median", "maximum")),
        )
    out.print(rows)
    v = s["values"]
    said = f"all channels: {valid_share(v['valid'])} valid, {number(v['minimum'])} to "
    said += f"{number(v['maximum'])}, {v['negative']} negative, {v['zero']} exactly zero"
    if len(shown) < len(s["channels"]):
        said += f"; {len(shown)} of {len(s['channels'])} channels shown, all with -v"
    out.print(said, style="dim")


def _quality(out: Console, s: dict[str, Any]) -> None:
    from fitting.cli.terminal import bullet, heading
    from fitting.quantities import count, percent

    out.print(heading("Quality"))
    r, t = s["reciprocity"], s["reciprocity_transmitted"]
    if r is None and t is None:
        bullet(out, "reciprocity cannot be tested: no exchanged directions were measured")
    index = s["relative_index"]
    over = f", over the squared index, {index:g} behind" if index != 1.0 else ""
    for found, light in ((r, ""), (t, f" in transmission{over}")):
        if found is not None:
            bullet(
                out,
                f"exchanging source and detector changes the data{light} by "
                f"{percent(found['median_relative_difference'])} (median of "
                f"{count(found['pairs'], 'pair')}, interpolated)",
            )
    total: dict[float, float] = {}
    for line in s["incidence"]:
        theta = line["theta_i_deg"]
        total[theta] = total.get(theta, 0.0) + (line["albedo"] or 0.0)
    for theta, albedo in [(t, a) for t, a in total.items() if a > 1.0][:3]:
        bullet(
            out,
            f"at theta_i = {theta:.1f} deg the data sum to "
            f"{percent(albedo)} of the light: more than falls in",
        )
    for note in s["notes"]:
        bullet(out, note["sentence"])


def _few(lines: list[dict[str, Any]]) -> list[dict[str, Any] | None]:
    """All lines, or the first and last of very many with a gap between."""
    return list(lines) if len(lines) <= 24 else [*lines[:16], None, *lines[-4:]]


def _rounded(value: float | None, decimals: int) -> str:
    return "-" if value is None else f"{round(value, decimals) + 0.0:g}"


def _range(ends: list[float]) -> str:
    low, high = round(ends[0], 1) + 0.0, round(ends[1], 1) + 0.0
    return f"{low:g}" if low == high else f"{low:g} to {high:g}"
