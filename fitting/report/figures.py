"""Figures of `fitting.plots` for a page: vectors where those are small, else pixels."""

from __future__ import annotations

import base64
import io
from collections.abc import Callable
from typing import TYPE_CHECKING

from fitting.plots import NoFigure, PlotsMissing, draw, listed, require
from fitting.report.alternative import in_words
from fitting.report.blocks import Block, Bullets, Folded, Picture, Words
from fitting.report.reported import Reported

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# What everybody wants to see, and what some do; the patch shows what the sphere does.
FIRST = ("slices", "sphere", "residuals", "albedo", "spectrum")
MORE = ("polar", "lobe", "image_slice", "beta", "correlations", "starts")

# More bytes of a vector figure are clouds of points.
_LARGEST_VECTOR = 160_000
_PIXELS_PER_INCH = 200.0
_CSS_PIXELS_PER_INCH = 96.0


def pictures(about: Reported, progress: Callable[[str], None]) -> list[Block]:
    """All the figures that can be drawn, and in words which can not."""
    try:
        require()
    except PlotsMissing as error:
        return [Words(f"There are no figures: {error}")]
    shows = {item.name: item.shows for item in listed()}
    left_out: list[str] = []

    def drawn(names: tuple[str, ...]) -> list[Block]:
        out: list[Block] = []
        for name in names:
            progress(name)
            try:
                figure = draw(name, about.result, about.measurement)
            except NoFigure as error:
                left_out.append(f"{name}: {error}")
                continue
            out.append(_picture(name, figure, shows[name], about))
        return out

    blocks, more = drawn(FIRST), drawn(MORE)
    if more:
        blocks.append(Folded("More figures", more))
    if left_out:
        blocks += [Words("Figures that are not here:"), Bullets(left_out)]
    return blocks


def _picture(name: str, figure: Figure, caption: str, about: Reported) -> Picture:
    width, height = figure.get_size_inches()
    return Picture(
        id=name,
        uri=encoded(figure),
        width=round(width * _CSS_PIXELS_PER_INCH),
        height=round(height * _CSS_PIXELS_PER_INCH),
        caption=caption,
        alternative=in_words(name, str(figure.get_label()), about.result) + ".",
    )


def encoded(figure: Figure) -> str:
    """The figure as a data URI. Letters become outlines: the font need not be there."""
    import matplotlib

    from fitting.plots.style import styled

    file = io.BytesIO()
    with styled(), matplotlib.rc_context({"svg.fonttype": "path"}):
        figure.savefig(file, format="svg", metadata={"Date": None})
    kind = "svg+xml"
    if file.tell() > _LARGEST_VECTOR:
        kind, file = "webp", io.BytesIO()
        with styled():
            figure.savefig(
                file, format="webp", dpi=_PIXELS_PER_INCH, pil_kwargs={"lossless": True}
            )
    return f"data:image/{kind};base64,{base64.b64encode(file.getvalue()).decode()}"
