"""What a report says, section by section, in the order in which somebody would ask."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from fitting.comparison import n_free, objective_error
from fitting.quantities import count, number, percent
from fitting.report import (
    about_data,
    citing,
    comparing,
    distances,
    figures,
    looking,
    parameters,
    reproduce,
)
from fitting.report.blocks import (
    Block,
    Bullets,
    Command,
    Folded,
    Section,
    Terms,
    Verdict,
    Words,
)
from fitting.report.reported import Reported
from fitting.result import FitResult


def sections(
    every: Sequence[Reported], viewer: bool, progress: Callable[[str], None]
) -> list[Section]:
    """All sections; the first result is told in full, and looked at with ``viewer``."""
    about = every[0]
    result = about.result
    found = [
        Section("verdict", "Verdict", verdict(about)),
        Section("look", "Look at it", looking.blocks(every) if viewer else []),
        Section("figures", "Figures", figures.pictures(about, progress)),
        Section("parameters", "Parameters", parameters.tables(result, "p-")),
        Section("determined", "What the data determine", _determined(result)),
        Section("distance", "How far it is from the data", distances.tables(result, "d-")),
        Section("physics", "Energy and reciprocity", about_data.constraints(about)),
        Section("data", "About the data", about_data.blocks(about)),
        Section("comparison", "Beside other models", comparing.blocks(every)),
        Section("others", "The other results", _others(every[1:])),
        Section("again", "Search, settings, and how to repeat it", _again(result)),
        Section("cite", "How to cite", citing.blocks(about)),
    ]
    return [s for s in found if s.blocks]


def verdict(about: Reported) -> list[Block]:
    """The verdict in words first, then the figures that matter most."""
    said, result = about.verdict, about.result
    out: list[Block] = [Verdict(said.level, said.headline)]
    out += [Bullets(said.advice)] if said.advice else []
    return [*out, Terms(_figures(result), large=True)]


def _figures(result: FitResult) -> list[tuple[str, str]]:
    objective = result.settings.objective
    data, held, colour = result.data, result.cross_validation, result.colour
    own, off = data.reciprocity or data.reciprocity_transmitted, result.typical_deviation
    out = [("Typical deviation from the data", "-" if off is None else percent(off))]
    if own is not None:
        share = percent(own.median_relative_difference)
        out.append(("The data's own, exchanging directions", share))
    out.append((f"Error ({objective})", number(objective_error(result), 3)))
    if held is not None:
        out.append((f"Error at unseen angles ({objective})", number(held.typical, 3)))
    if colour is not None:
        out.append(("Mean colour difference, CIEDE2000", f"{colour.mean:.2f}"))
    out.append(("Largest albedo", f"{result.energy.max_albedo:.3f}"))
    out.append(("Free parameters", str(n_free(result))))
    values = f"{data.rows_used} by {len(result.channels)}"
    return [*out, ("Directions by channels", values)]


def _determined(result: FitResult) -> list[Block]:
    return [Bullets(result.identifiability)] if result.identifiability else []


def _others(others: Sequence[Reported]) -> list[Block]:
    return [
        Folded(
            f"{one.file or one.name}: {one.result.model}",
            [
                *verdict(one),
                *parameters.tables(one.result, f"p{k}-"),
                *distances.tables(one.result, f"d{k}-"),
            ],
        )
        for k, one in enumerate(others, start=1)
    ]


def _again(result: FitResult) -> list[Block]:
    s, found = result.settings, result.solver
    runner_up = found.runner_up_cost_ratio
    terms = [
        ("Objective", s.objective),
        ("Weights", s.weights),
        ("Largest polar angle", f"{s.max_theta_deg:g} deg"),
        ("Robust", "yes" if s.robust else "no"),
        ("Noise assumed", _noise(s.noise)),
        ("Shape parameters", "per channel" if s.per_channel_shape else "of all channels"),
        ("Starts", f"{found.starts}, of which {found.starts_agreeing} agree"),
        ("Steps", str(found.steps)),
        ("Cost", number(found.cost)),
        ("Cost of the next minimum", f"{number(runner_up)} times" if runner_up else "-"),
        ("Versions", ", ".join(f"{k} {v}" for k, v in result.versions.items())),
    ]
    terms += [(f"Material of {k}", v) for k, v in s.material.items()]
    return [
        Words(f"The search {found.sentence}."),
        Terms(terms),
        Words("To repeat it:"),
        Command(reproduce.command(result)),
        Bullets(reproduce.what_is_missing(result)),
    ]


def _noise(noise: tuple[float, float] | None) -> str:
    if noise is None:
        return "none"
    return f"{percent(noise[0])} and {number(noise[1])} per sr"


def heading(about: Reported) -> tuple[str, str]:
    """The title of the page, and what stands below it."""
    result = about.result
    names = count(len(result.channels), "channel")
    return about.name, f"{result.model}, {count(result.data.rows_used, 'row')}, {names}"
