"""Scene files: what they may hold, and what is said of those that hold something else."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fitting.scene import Scene, SceneError, load_scene
from fitting.scene.check import checked
from fitting.scene.description import Disk, Histogram
from fitting.scene.fields import sections
from fitting.scene.histogram import pairs
from fitting.scene.load import PRESETS, preset_text
from fitting.scene.spectra import power

FILE = """\
{top}
[[lights]]
kind = "disk"
diameter_deg = 3
{light}
[seen]
kind = "flat"
{seen}
[tolerance.albedo]
{rest}
"""


def wrong(tmp_path: Path, **parts: str) -> str:
    """What is said of a file with these parts."""
    path = tmp_path / "own.toml"
    path.write_text(FILE.format(**{"top": "", "light": "", "seen": "", "rest": ""} | parts))
    with pytest.raises(SceneError) as caught:
        load_scene(path)
    said = str(caught.value)
    assert said.startswith(f"{path}: ")
    assert "\n" not in said
    return said.removeprefix(f"{path}: ")


@pytest.mark.parametrize("name", PRESETS)
def test_presets_are_scenes_with_comments(name, tmp_path):
    scene = load_scene(name)
    assert scene.name == name
    assert scene.description
    assert preset_text(name).startswith("# ")
    # As a file it is the same scene, and all that a file is looked up for is found.
    copied = tmp_path / f"{name}.toml"
    copied.write_text(preset_text(name))
    assert load_scene(copied) == scene
    assert msgspec.convert(msgspec.to_builtins(scene), Scene) == scene


@pytest.mark.parametrize(
    ("light", "says"),
    [
        ("theta_deg = 200", "lights[0].theta_deg is 200; expected a number from 0 to 180"),
        (
            "theta_dg = 20",
            "lights[0].theta_dg is no key of a disk; did you mean theta_deg?",
        ),
        ("theta_deg = nan", "lights[0].theta_deg is nan; expected a number from 0"),
        ("brightness = inf", "lights[0].brightness is inf; expected a number above 0"),
        ("brightness = '3'", "lights[0].brightness is '3'; expected a number above 0"),
        ("brightness = true", "lights[0].brightness is true; expected a number"),
        (
            "spectrum = 'D66'",
            "lights[0].spectrum: there is no illuminant 'D66'; did you mean",
        ),
        ("spectrum = { file = 'x.csv' }", "x.csv: No such file"),
        (
            "spectrum = { blackbody = 1 }",
            "spectrum.blackbody is no key; did you mean blackb",
        ),
        ("spectrum = {}", "lights[0].spectrum: found none; expected exactly one of"),
        (
            "spectrum = { bands = [] }",
            "bands has 0 entries; expected a list of one or more",
        ),
        (
            "spectrum = { bands = [[500, 400, 1]] }",
            "the band 500 to 400 nm; expected from <",
        ),
        (
            "spectrum = { bands = [[400, 500, -1]] }",
            "bands[0][2] is -1; expected a number n",
        ),
        ("spectrum = { rgb = [0, 0, 0] }", "rgb is 0 everywhere; expected some light"),
        ("spectrum = 1979-05-27", "lights[0].spectrum is 1979-05-27; expected text or a"),
        ("theta_deg = 95", "no light falls on a flat sample; expected less than 91.5"),
        ("diameter_deg = 4", "not TOML"),
        ("[[lights]]\nkind = 'softbox'", "lights[1].kind is 'softbox'; expected direction"),
        ("[[lights]]\nkind = 'dsik'", "lights[1].kind is 'dsik'; did you mean disk?"),
        ("[[lights]]\ntype = 1", "lights[1].kind is missing; expected direction, disk, u"),
        ("[[lights]]\nkind = 'disk'", "lights[1].diameter_deg is missing; expected a numb"),
        (
            "[[lights]]\nkind = 'sky'\ntype = 12",
            "lights[1]: a sky of type 12 depends on the",
        ),
        (
            "[[lights]]\nkind = 'sky'\ntype = 17",
            "lights[1].type is 17; expected an integer ",
        ),
    ],
)
def test_mistakes_in_lights(tmp_path, light, says):
    assert says in wrong(tmp_path, light=light)


@pytest.mark.parametrize(
    ("rest", "says"),
    [
        ("maximm = 1", "tolerance.albedo.maximm is no key; did you mean maximum?"),
        ("maximum = 0", "tolerance.albedo.maximum is 0; expected a number above 0"),
        (
            "[tolerance.colour_difference]",
            "found colour_difference and albedo; expected ex",
        ),
        ("[viewer]\nobserver = '3'", "viewer.observer: there is no observer '3'"),
        ("[viewer]\nexposure = 'auo'", "viewer.exposure is 'auo'; expected a number above"),
        ("[viewer]\nexposure = -1", "viewer.exposure is -1; expected"),
        (
            "[viewer]\nwavelengths_nm = [700, 400]",
            "viewer: wavelengths_nm is [700.0, 400.0]",
        ),
        ("[viewer]\nwavelengths_nm = [400]", "has 1 entries; expected 2 numbers from 100"),
        ("[viewer]\nclip = 1", "viewer.clip is 1; expected true or false"),
        ("[viewr]", "viewr is no key; did you mean viewer?"),
    ],
)
def test_mistakes_elsewhere(tmp_path, rest, says):
    assert says in wrong(tmp_path, rest=rest)


def test_mistakes_of_what_is_seen(tmp_path):
    assert "seen.theta_deg is 30; expected 2 numbers" in wrong(
        tmp_path, seen="theta_deg=30"
    )
    assert "ascending" in wrong(tmp_path, seen="theta_deg = [50, 10]")
    assert "at most a full turn" in wrong(tmp_path, seen="phi_deg = [-90, 280]")
    assert "ground_reflectance is 2" in wrong(tmp_path, top="ground_reflectance = 2")
    assert "seen.pixels is no key of a flat" in wrong(tmp_path, seen="pixels = 64")


def test_an_instrument_sees_no_colours():
    plain = tomllib.loads(preset_text("overcast"))
    plain["viewer"]["observer"] = "none"
    with pytest.raises(SceneError, match="tolerance is a colour difference"):
        checked(plain)


def test_files_that_are_no_scenes(tmp_path):
    for name, says in {
        "overcst": "neither a file nor a preset; did you mean overcast?",
        "nothing.toml": "presets: overcast, studio, sun, daylighting, stray-light",
        str(tmp_path): "is a folder; expected a scene",
    }.items():
        with pytest.raises(SceneError, match=says):
            load_scene(name)
    binary = tmp_path / "binary.toml"
    binary.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(SceneError, match="not a text file in UTF-8"):
        load_scene(binary)
    binary.write_text("")
    with pytest.raises(
        SceneError, match="lights is missing; expected a list of one or more"
    ):
        load_scene(binary)


def test_defaults_and_paths(tmp_path, monkeypatch):
    """Paths are relative to the file, not to where one stands."""
    (tmp_path / "lamps").mkdir()
    (tmp_path / "lamps" / "lamp.csv").write_text(
        "nm;power\n400;0,5\n500;1,0 # peak\n600;0\n"
    )
    path = tmp_path / "own.toml"
    spectrum = "spectrum = { file = 'lamps/lamp.csv' }"
    path.write_text(FILE.format(top="", light=spectrum, seen="", rest=""))
    monkeypatch.chdir(Path("/"))
    scene = load_scene(path)
    assert scene.name == "own"
    disk = scene.lights[0]
    assert isinstance(disk, Disk)
    assert disk.brightness == 1
    table = power(disk.spectrum)
    np.testing.assert_allclose(
        table.of(np.array([399.0, 450.0, 550.0, 601.0])), [0, 0.75, 0.5, 0]
    )


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (
            "400,1\n500,a\n",
            "line 2 is '500,a'; expected 2 columns of numbers: wavelength in",
        ),
        ("400,1\n500,nan\n", "line 2 is '500,nan'"),
        ("400,1,2\n", "line 1 is '400,1,2'"),
        ("nm,power\n", "no numbers in it"),
        ("500,1\n400,1\n", "at least two wavelengths in nm, ascending"),
        ("0.4,1\n0.5,1\n", "wavelengths from 0.4 to 0.5; expected nm"),
        ("400,-1\n500,1\n", "powers go from -1 to 1; expected none below 0"),
    ],
)
def test_mistakes_in_tables(tmp_path, text, says):
    (tmp_path / "lamp.csv").write_text(text)
    assert says in wrong(tmp_path, light="spectrum = { file = 'lamp.csv' }")


def test_histograms(tmp_path):
    (tmp_path / "h.txt").write_text(
        "# seen in a car\ntheta_i\tphi_i\ttheta_r\tphi_r\tweight\n10 0 20 180 3\n"
        "30 -90 0 0 1\n80 0 80 180 0\n"
    )
    plain: dict[str, Any] = {
        "lights": [{"kind": "direction"}],
        "seen": {"kind": "histogram", "file": str(tmp_path / "h.txt")},
        "tolerance": {"albedo": {}},
    }
    seen = checked(plain).seen
    assert isinstance(seen, Histogram)
    found = pairs(seen)
    np.testing.assert_allclose(found.weight, [0.75, 0.25])
    np.testing.assert_allclose(np.degrees(found.phi_i), [0, -90], atol=1e-12)
    np.testing.assert_allclose(np.degrees(found.theta_r), [20, 0], atol=1e-12)
    inline = {"kind": "histogram", "rows": [[10, 0, 20, 180, 3.0], [30, -90, 0, 0, 1]]}
    same = checked(plain | {"seen": inline}).seen
    assert isinstance(same, Histogram)
    np.testing.assert_array_equal(pairs(same).weight, found.weight)
    for seen, says in (
        ({"kind": "histogram"}, "found none of file and rows"),
        (inline | {"file": "x"}, "found both of file and rows"),
        ({"kind": "histogram", "rows": [[95, 0, 0, 0, 1]]}, "rows.0..0. is 95; expected"),
        ({"kind": "histogram", "rows": [[5, 0, 0, 0, 0]]}, "no weight above 0"),
    ):
        with pytest.raises(SceneError, match=says):
            checked(plain | {"seen": seen})
    sky = {"kind": "uniform"}
    with pytest.raises(SceneError, match="single direction or disk"):
        checked(plain | {"seen": inline, "lights": [sky]})
    with pytest.raises(SceneError, match="no theta_deg and phi_deg"):
        checked(plain | {"lights": [{"kind": "direction", "theta_deg": 5}]})
    (tmp_path / "h.txt").write_text("10 0 120 180 3\n")
    with pytest.raises(SceneError, match="theta_r of row 1 is 120; expected 0 to 90"):
        pairs(Histogram(file=str(tmp_path / "h.txt")))


def test_fields_are_all_that_the_schema_has():
    """Against msgspec's own JSON Schema of the definitions."""
    defined = msgspec.json.schema(Scene)["$defs"]
    in_schema = {key for table in defined.values() for key in table["properties"]}
    said = {f.key for s in sections() for f in s.fields}
    assert said == in_schema
    for section in sections():
        for field in section.fields:
            assert field.meaning.endswith("."), field
            assert field.expected, field
    required = {f.key for s in sections() for f in s.fields if f.default is None}
    assert {"lights", "seen", "tolerance", "kind", "diameter_deg", "type"} <= required
    assert "brightness" not in required


JUNK = st.one_of(
    st.none(), st.booleans(), st.integers(-1000, 1000), st.floats(), st.text(max_size=5),
    st.lists(st.floats(), max_size=3), st.dictionaries(st.text(max_size=5), st.floats()),
)  # fmt: skip


@settings(max_examples=100, deadline=None)
@given(data=st.data(), name=st.sampled_from(PRESETS), junk=JUNK)
def test_anything_else_is_refused_in_a_sentence(data, name, junk):
    """Somewhere in a preset there is something else, or something more."""
    plain = tomllib.loads(preset_text(name))
    place: Any = plain
    while True:
        keys = list(place) if isinstance(place, dict) else list(range(len(place)))
        key = data.draw(
            st.sampled_from([*keys, "more"] if isinstance(place, dict) else keys)
        )
        if key == "more" or not (
            isinstance(place[key], dict | list) and data.draw(st.booleans())
        ):
            break
        place = place[key]
    place[key] = junk
    said = ""
    try:
        checked(plain)
    except SceneError as error:
        said = str(error)
    # What is more is always wrong, and so is nothing; other junk may happen to fit.
    assert said or (key != "more" and junk is not None)
    assert "\n" not in said
    assert not said.startswith(":")
