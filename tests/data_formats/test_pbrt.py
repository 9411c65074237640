"""The pbrt-v2 stream of numbers."""

from __future__ import annotations

from pathlib import Path

import pytest

import data_formats
from data_formats import Measurement, MeasurementError

TEXT = """# a made-up paint
# num
2
450
  550 # nm

0.5 0 0.6 3.1 0.25 0.35
0.5 0 0.7 -0.1 0.24
0.34
"""


@pytest.fixture
def read(tmp_path: Path):
    """Read a text as a `.brdf` file."""

    def read_text(text: str) -> Measurement:
        path = tmp_path / "made.brdf"
        path.write_text(text)
        return data_formats.read(path)

    return read_text


def test_line_breaks_and_comments_do_not_matter(read):
    m = read(TEXT)
    assert m.wavelengths.tolist() == [450, 550]
    assert m.value.tolist() == [[0.25, 0.35], [0.24, 0.34]]
    assert m.phi_r.tolist() == [3.1, -0.1]
    assert m.provenance.format == "pbrt"
    assert m.provenance.header["comments"].startswith("a made-up paint")
    numbers = " ".join(line.partition("#")[0] for line in TEXT.splitlines())
    assert read(numbers).equals(m)
    assert read(TEXT.replace("\n", "\r")).equals(m)


def test_same_as_astm_with_the_cornell_quirks(tmp_path, write_astm, shadowed_rows):
    nm = range(400, 701, 10)
    names = "theta_i,phi_i,theta_s,phi_s," + ",".join(f"{w}nm" for w in nm)
    astm = data_formats.read(write_astm(shadowed_rows, names))
    path = tmp_path / "made.brdf"
    rows = "\n".join(" ".join(f"{x:.15g}" for x in row) for row in shadowed_rows)
    path.write_text(f"31\n{' '.join(map(str, nm))}\n{rows}\n")
    pbrt = data_formats.read(path)
    assert pbrt.equals(astm)
    assert pbrt.notes == astm.notes
    assert (~pbrt.valid).any(axis=1).sum() == 4


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (TEXT.replace("0.34", ""), "do not make whole records"),
        (TEXT + "1\n", "do not make whole records"),
        (TEXT.replace("0.7", "x"), "line 8: 'x' is not a number"),
        (TEXT.replace("0.5", "3.2"), "line 7: theta_i is 183"),
        (TEXT.replace("450", "-450"), "wavelengths from -450 to 550 nm"),
        (TEXT.replace("550", "450"), "two channels have the name 450 nm"),
        (TEXT.replace("2\n450", "0\n450"), "expected the number of wavelengths"),
        ("# nothing\n", "expected the number of wavelengths"),
        ("9999\n450 550 650\n", "do not make whole records"),
    ],
)
def test_errors(read, text, message):
    with pytest.raises(MeasurementError, match=message) as caught:
        read(text)
    assert "made.brdf" in str(caught.value)
