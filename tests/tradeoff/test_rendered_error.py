"""The image among the errors."""

from __future__ import annotations

import pytest
import synthetic

from data_formats import read
from fitting import FitOptions, fit
from fitting.sample import sample_path
from fitting.scene import load_scene
from fitting.tradeoff.errors import errors_of
from fitting.tradeoff.rendered_error import stage_of
from fitting.tradeoff.trade import NotPossible


@pytest.mark.slow
def test_an_image_sees_the_gloss_that_a_matt_fit_lacks():
    m = read(sample_path())
    stage = stage_of(m, load_scene("studio"))
    matt, glossy = (
        errors_of(m, fit(m, model, FitOptions(), cross_validate=False), stage).image
        for model in ("lambert", "lambert + ggx")
    )
    assert matt.scene == "studio"
    assert matt.measure == "colour difference"
    # The sample is glossy: a matt fit is seen to be off, one lobe is hardly.
    assert matt.mean > 2.0 > 1.0 > glossy.mean > 0.0
    assert glossy.percentile_95 > glossy.mean
    # One part in a hundred of noise is about 0.1 of a colour difference.
    assert 0.01 < glossy.noise < 0.3


def test_transmitted_light_has_no_image():
    angles = list(synthetic.directions(theta_i_deg=(10.0, 40.0), rings=6, azimuths=5))
    angles[2] = 3.141592653589793 - angles[2]
    m = synthetic.measurement("lambert_transmission", {}, angles=angles)
    with pytest.raises(NotPossible, match="no row is left"):
        stage_of(m, load_scene("studio"))
