"""Error against cost of the candidates of `brdf tradeoff`, with the front marked."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from fitting.quantities import percent
from fitting.tradeoff.table import COST_WORDS, Candidate, ErrorAxis, Tradeoff, judged

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

_ERRORS: dict[ErrorAxis, str] = {
    "held-out": "{objective} on angles of incidence not fitted, typical RMS",
    "fitted": "{objective} on the rows fitted, RMS",
    "albedo": "error of the albedo, RMS",
    "image": "difference of the image from the data's, mean",
}
_TIMED = ("float32", "float64", "fit")
# Size of type in points, and the mean width of a character over it.
_LABEL, _CHARACTER = 8.0, 0.62

Box = tuple[float, float, float, float]


class Point(NamedTuple):
    """A candidate where it is drawn."""

    cost: float
    error: float
    candidate: Candidate


def draw(table: Tradeoff, axes: Axes | None = None) -> Figure:
    """Draw the table into some axes, or into a new figure; returns the figure.

    Both axes are logarithmic. Filled circles on a stepped line are the front, open squares
    what is dominated, by the axes that the table now has, numbered from cheap to dear;
    horizontal lines are the noise of the data by each account that they allow. Measured
    times have bars from quartile to quartile.
    """
    from matplotlib.figure import Figure

    from fitting.plots.style import styled

    table = judged(table)
    with styled():
        if axes is None:
            figure = Figure(figsize=(8.5, 4.6), layout="constrained")
            axes = figure.add_subplot()
        points = _points(table)
        noise = _noise(axes, table)
        _limits(axes, points, noise)
        _candidates(axes, table, points)
        axes.set_xlabel(COST_WORDS[table.cost_axis])
        axes.set_ylabel(_ERRORS[table.error_axis].format(objective=table.objective))
        about = table.sample or table.path.rpartition("/")[2]
        axes.set_title(f"What accuracy costs: {about}" if about else "What accuracy costs")
        found = axes.get_figure(root=True)
        if not isinstance(found, Figure):
            raise ValueError("the axes belong to no figure")
        lines = axes.get_legend_handles_labels()[0]
        found.legend(handles=[*_names(points), *lines], loc="outside right upper")
        # The layout tells where numbers have room.
        found.draw_without_rendering()
        _numbers(axes, points)
    return found


def _points(table: Tradeoff) -> list[Point]:
    """What can be drawn, from cheap to dear."""
    found = [
        Point(c.cost(table.cost_axis), error, c)
        for c in table.candidates
        if (error := c.error(table.error_axis, table.objective)) is not None and error > 0
    ]
    return sorted(found, key=lambda p: (p.cost, -p.error))


def _limits(axes: Axes, points: list[Point], noise: list[float]) -> None:
    """Logarithmic axes with room for the labels at the right."""
    from fitting.plots.log_axis import set_log_scale

    cost = [p.cost for p in points if p.cost > 0] or [1.0]
    error = [*(p.error for p in points), *noise] or [1.0]
    wide = max(max(cost) / min(cost), 4.0)
    high = max(max(error) / min(error), 4.0)
    set_log_scale(axes.xaxis, min(cost) / wide**0.08, max(cost) * wide**0.08)
    set_log_scale(axes.yaxis, min(error) / high**0.12, max(error) * high**0.15)


def _candidates(axes: Axes, table: Tradeoff, points: list[Point]) -> None:
    from fitting.plots.style import BLUE, GREY, VERMILLION

    front = [p for p in points if p.candidate.on_front]
    others = [p for p in points if not p.candidate.on_front]
    if front:
        axes.plot(
            [p.cost for p in front], [p.error for p in front], drawstyle="steps-post",
            color=BLUE, linewidth=1.2, zorder=2,
        )  # fmt: skip
    for group, marker, colour, fill in (
        (front, "o", BLUE, BLUE),
        (others, "s", VERMILLION, "white"),
    ):
        if not group:
            continue
        axes.errorbar(
            [p.cost for p in group], [p.error for p in group],
            xerr=_bars([p.candidate for p in group], table), linestyle="none",
            marker=marker, markersize=6.0, color=colour, markerfacecolor=fill,
            markeredgecolor=colour, ecolor=GREY, elinewidth=0.8, zorder=3,
        )  # fmt: skip


def _names(points: list[Point]) -> list[Line2D]:
    """Legend entries that say which number is which model, and what the marks mean."""
    from matplotlib.lines import Line2D

    from fitting.plots.style import BLUE, VERMILLION

    def entry(label: str, on_front: bool) -> Line2D:
        mark, colour = ("o", BLUE) if on_front else ("s", VERMILLION)
        fill = colour if on_front else "white"
        return Line2D(
            [], [], linestyle="none", marker=mark, markersize=5.0, color=colour,
            markerfacecolor=fill, label=label,
        )  # fmt: skip

    out = [
        entry(f"{k}  {p.candidate.model}", p.candidate.on_front)
        for k, p in enumerate(points, start=1)
    ]
    kinds = {p.candidate.on_front for p in points}
    return out + [
        Line2D([], [], linestyle="none", label=said)
        for on_front, said in ((True, "filled: Pareto front"), (False, "open: dominated"))
        if on_front in kinds
    ]


def _numbers(axes: Axes, points: list[Point]) -> None:
    """Numbers beside the points, where they cover neither each other nor a point."""
    from fitting.plots.style import INK

    at = axes.transData.transform([(p.cost, p.error) for p in points])
    at = at * 72.0 / axes.figure.dpi
    taken = [(x - 4, y - 4, x + 4, y + 4) for x, y in at]
    for k, ((x, y), p) in enumerate(zip(at, points, strict=True), start=1):
        width = _LABEL * _CHARACTER * len(str(k))
        places = [(5.0, 4.0), (5.0, -11.0), (-5.0 - width, 4.0), (-5.0 - width, -11.0)]
        boxes = [(x + a, y + b, x + a + width, y + b + _LABEL) for a, b in places]
        free = [n for n, b in enumerate(boxes) if not any(_overlap(b, t) for t in taken)]
        chosen = (free or [0])[0]
        taken.append(boxes[chosen])
        axes.annotate(
            str(k), (p.cost, p.error), xytext=places[chosen], textcoords="offset points",
            fontsize=_LABEL, color=INK,
        )  # fmt: skip


def _overlap(one: Box, other: Box) -> bool:
    beside = one[0] > other[2] or one[2] < other[0]
    return not (beside or one[1] > other[3] or one[3] < other[1])


def _bars(group: list[Candidate], table: Tradeoff) -> list[list[float]] | None:
    """Distances to the quartiles of what is timed."""
    if table.cost_axis not in _TIMED:
        return None
    below: list[float] = []
    above: list[float] = []
    for c in group:
        times = c.evaluation.of(table.cost_axis)
        spread = c.fit.seconds if times is None else times.batched_ns
        below.append(spread.median - spread.low)
        above.append(spread.high - spread.median)
    return [below, above]


def _noise(axes: Axes, table: Tradeoff) -> list[float]:
    """Draw the noise of the data, where the error is in its unit; the heights."""
    from fitting.plots.style import GREEN, ORANGE, PURPLE

    heights: list[float] = []
    images = [c.errors.image for c in table.candidates if c.errors.image is not None]
    if table.error_axis == "image" and images and images[0].noise > 0:
        heights.append(images[0].noise)
        axes.axhline(
            heights[0], color=ORANGE, linestyle=(0, (4, 2)), linewidth=1.2, zorder=1,
            label="noise of the data in the image",
        )  # fmt: skip
    if table.error_axis not in ("held-out", "fitted"):
        return heights
    colours = {"sigma": GREEN, "repeats": ORANGE, "reciprocity": PURPLE}
    words = {
        "sigma": "noise stated in the file",
        "repeats": "noise of repeated rows",
        "reciprocity": "noise, from exchanged directions",
    }
    for floor in table.noise_floors:
        height = floor.typical if table.error_axis == "held-out" else floor.error
        if height > 0:
            heights.append(height)
            axes.axhline(
                height, color=colours[floor.source], linestyle=(0, (4, 2)), linewidth=1.2,
                label=f"{words[floor.source]}: {percent(floor.relative)} of a value",
                zorder=1,
            )  # fmt: skip
    return heights
