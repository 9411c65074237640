"""The bundled sample is what its generator says it is."""

from __future__ import annotations

import numpy as np

from data_formats import read
from fitting.sample import make_sample, sample_path


def test_the_file_is_what_the_generator_makes():
    file, made = read(sample_path()), make_sample()
    assert file.channels == made.channels
    assert file.symmetry == made.symmetry
    for name in ("theta_i", "phi_i", "theta_r", "phi_r", "valid"):
        np.testing.assert_array_equal(getattr(file, name), getattr(made, name))
    # The last ulp of a model differs between machines, and may turn a rounding.
    np.testing.assert_allclose(file.value, made.value, rtol=2e-4, atol=1e-9)


def test_the_file_is_small_and_says_that_it_is_synthetic():
    assert sample_path().stat().st_size < 150_000
    head = sample_path().read_text().partition("VARS")[0].lower()
    assert "synthetic" in head
    assert "not a measurement" in head
    assert read(sample_path()).n_rows == 600


def test_rows_around_the_source_are_missing():
    m = read(sample_path())
    cosine = np.cos(m.theta_i) * np.cos(m.theta_r)
    cosine = cosine + np.sin(m.theta_i) * np.sin(m.theta_r) * np.cos(m.phi_r - m.phi_i)
    assert np.degrees(np.arccos(np.clip(cosine, -1, 1))).min() > 5.9
