"""Every figure draws for several kinds of results, without a warning, in every format."""

from __future__ import annotations

import dataclasses
import re
import sys

import pytest

from fitting.plots import FIGURES, NoFigure, draw, listed, save

USES = {item.name: item.data for item in listed()}
OF_DATA = [name for name, use in USES.items() if use != "unused"]


@pytest.mark.parametrize("name", FIGURES)
def test_draws_several_wavelengths(name, paint, drawn):
    figure = drawn("paint", name)
    assert paint.result.model in figure.get_suptitle()
    assert "two_lobe_paint.astm" in figure.get_suptitle()
    assert any("brdf-fitting" in text.get_text() for text in figure.texts)


@pytest.mark.parametrize("name", OF_DATA)
def test_draws_one_channel_and_one_angle_of_incidence(name, drawn):
    assert "lambert" in drawn("matt", name).get_suptitle()


# To interpolate anisotropic data takes long.
SLOW = ("sphere", "patch")


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=pytest.mark.slow) if n in SLOW else n for n in OF_DATA]
)
def test_draws_both_sides_of_an_anisotropic_sample(name, drawn):
    assert "lambert(back)" in drawn("leaf", name).get_suptitle()


@pytest.mark.parametrize("name", OF_DATA)
def test_draws_without_data_what_needs_none(name, matt, drawn):
    if USES[name] == "needed":
        with pytest.raises(NoFigure, match="measurement"):
            draw(name, matt.result)
        return
    assert drawn("matt", name, data=False).axes


def test_one_channel_has_no_spectrum_and_one_parameter_no_correlation(matt):
    for name in ("spectrum", "correlations"):
        with pytest.raises(NoFigure, match=r"single channel|only lambert"):
            draw(name, matt.result)


def test_no_state_of_pyplot_is_touched(paint):
    before = sys.modules.get("matplotlib.pyplot")
    figure = draw("starts", paint.result)
    assert not hasattr(figure, "number")
    assert sys.modules.get("matplotlib.pyplot") is before


def test_the_style_ends_with_the_drawing(paint):
    import matplotlib

    before = dict(matplotlib.rcParams)
    draw("starts", paint.result)
    assert dict(matplotlib.rcParams) == before


def test_text_is_text_and_equal_figures_are_equal_files(paint, tmp_path):
    for name in ("a.svg", "b.svg", "a.pdf"):
        save(draw("starts", paint.result), tmp_path / name)
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()
    assert len(list(tmp_path.iterdir())) == 3
    svg = (tmp_path / "a.svg").read_text("utf-8")
    assert re.search(r"<text[^>]*>[^<]*two_lobe_paint\.astm", svg)
    pdf = (tmp_path / "a.pdf").read_bytes()
    # The file of a TrueType font: Type 3 outlines would have none.
    assert b"/FontFile2" in pdf
    assert b"/Type3" not in pdf
    assert b"CreationDate" not in pdf


def test_large_clouds_of_points_are_pixels_in_vector_files(drawn, tmp_path):
    save(drawn("leaf", "residuals"), tmp_path / "large.svg", dpi=40)
    save(drawn("paint", "beta"), tmp_path / "small.svg")
    assert "<image" in (tmp_path / "large.svg").read_text("utf-8")
    assert "<image" not in (tmp_path / "small.svg").read_text("utf-8")


def test_a_failed_write_leaves_nothing(paint, tmp_path):
    figure = draw("starts", paint.result)
    with pytest.raises(ValueError, match="tiff"):
        save(figure, tmp_path / "a.tiff")
    with pytest.raises(ValueError, match="2 figures"):
        save([figure, figure], tmp_path / "a.png")
    assert not list(tmp_path.iterdir())


def test_channels_that_are_not_there(paint):
    with pytest.raises(NoFigure, match="there is no channel '555 nm'"):
        draw("slices", paint.result, channels=("555 nm",))


def test_other_channels(paint, leaf):
    with pytest.raises(NoFigure, match="must be the same"):
        draw("slices", paint.result, leaf.data)


def test_other_data_are_named(paint):
    other = dataclasses.replace(
        paint.data, provenance=dataclasses.replace(
            paint.data.provenance, path="/far/other.astm", sha256="0" * 64)
    )  # fmt: skip
    title = draw("starts", paint.result, other).get_suptitle()
    assert "two_lobe_paint.astm, compared with other.astm" in title
