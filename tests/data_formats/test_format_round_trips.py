"""Whatever a measurement holds, formats that hold all of it give it back bit for bit."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import data_formats
from data_formats import Channel, Measurement, Note, Provenance

WHOLE = ("astm", "csv", "hdf5")
SUFFIXES = [i.suffixes[0] for i in data_formats.formats() if i.name in WHOLE]

names = st.text(min_size=1, max_size=12).filter(lambda t: t.strip() and t.isprintable())
text = st.text(max_size=20)
wavelengths = st.none() | st.floats(1e-3, 1e6)


@st.composite
def measurements(draw: st.DrawFn) -> Measurement:
    n, c = draw(st.integers(1, 5)), draw(st.integers(1, 4))
    theta = st.floats(0, np.pi)
    phi = st.floats(-1e3, 1e3)
    number = st.floats(allow_nan=False, allow_infinity=False)

    def column(elements, shape=(n,)):
        return draw(arrays(np.float64, shape, elements=elements))

    value = column(number, (n, c))
    valid = draw(arrays(np.bool_, (n, c)))
    valid[0, 0] = True
    lost = ~valid & draw(arrays(np.bool_, (n, c)))
    nm = draw(
        st.lists(wavelengths, min_size=c, max_size=c, unique_by=lambda w: w or object())
    )
    labels = draw(st.lists(names, min_size=c, max_size=c, unique=True))
    sigma = column(st.floats(1e-300, 1e300), (n, c))
    return Measurement(
        theta_i=column(theta),
        phi_i=column(phi),
        theta_r=column(theta),
        phi_r=column(phi),
        value=np.where(lost, np.nan, value),
        valid=valid,
        channels=tuple(map(Channel, labels, nm)),
        sigma=sigma if draw(st.booleans()) else None,
        symmetry=draw(st.sampled_from(["isotropic", "bilateral", "anisotropic"])),
        provenance=draw(
            st.builds(
                Provenance, text, text, text, text, text, text, st.dictionaries(text, text)
            )
        ),
        notes=tuple(
            draw(st.lists(st.builds(Note, text, text, st.integers(0)), max_size=2))
        ),
        auxiliary=draw(
            st.dictionaries(
                names, arrays(np.float64, (n,), elements=st.floats()), max_size=2
            )
        ),
    )


@pytest.mark.parametrize("suffix", SUFFIXES)
@settings(
    max_examples=60,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
@given(measurement=measurements())
def test_round_trip(suffix, measurement, tmp_path):
    path = tmp_path / f"m{suffix}"
    data_formats.write(measurement, path)
    again = data_formats.read(path)
    assert again.notes == measurement.notes
    if measurement.provenance.sha256:
        assert again.provenance == measurement.provenance
    assert again.equals(measurement)
