"""From traced programs to GLSL, without a browser."""

from __future__ import annotations

import base64
import re
from pathlib import Path

import numpy as np
import pytest

from data_formats import Channel, Measurement
from fitting.model import Model
from fitting.viewer import TranslationError, assets
from fitting.viewer.blocks import flat_index, literal
from fitting.viewer.glsl import shader
from fitting.viewer.measured import MOST_NUMBERS, packed
from fitting.viewer.primitives import TEMPLATES
from fitting.viewer.structure import STRUCTURE

OWN = '''
import jax
import jax.numpy as jnp
from fitting.models.lobe import Lobe
from fitting.parameters import coefficient


class Looping(Lobe):
    """``f = a x``, by a loop whose length is not known."""

    NAME = "looping"
    REFERENCE = "none"
    RECIPROCAL = False
    LINEAR = True
    ALBEDO_BOUND = None

    def parameters(self):
        return (coefficient("a", 0.1, "factor"),)

    def basis(self, shape, geometry):
        start = jnp.asarray(geometry.cos_i)
        value = jax.lax.while_loop(lambda x: jnp.max(x) > 1.0, lambda x: 0.5 * x, start)
        return (jnp.where(geometry.reflects, value, 0.0),)

    def amplitudes(self, shape, coefficients):
        return coefficients

    def peak(self, shape):
        return None
'''


def test_what_has_no_translation_is_named(tmp_path: Path) -> None:
    file = tmp_path / "looping.py"
    file.write_text(OWN)
    with pytest.raises(TranslationError, match=r"looping\.py.*the operation 'while'"):
        shader(Model(f"lambert + {file}"))


def test_what_depends_on_parameters_only_is_prepared() -> None:
    """The quadrature of the norm of sgd is not done again for every pixel."""
    translated = shader(Model("sgd"))
    assert "for (" in translated.prepare
    assert "for (" not in translated.evaluate
    assert translated.basis == 3
    assert translated.parameters == tuple(Model("sgd").parameters())


def test_literals_are_those_of_float32() -> None:
    for value in (0.1, 1.0, -2.5e-7, 1e20, 3.0):
        read = float(literal(value, "float").strip("()"))
        assert np.float32(read) == np.float32(value)
        assert re.search(r"[.e]", literal(value, "float"))
    assert literal(float("inf"), "float") == "uintBitsToFloat(0x7f800000u)"
    assert literal(True, "bool") == "true"


def test_positions_in_arrays() -> None:
    assert flat_index((4, 5), ("2", "3")) == "13"
    assert flat_index((4, 5), ("i", "3")) == "3 + 5 * (i)"
    assert flat_index((4, 1), ("i", "j")) == "i"
    assert flat_index((), ()) == "0"


def test_functions_that_translations_call_exist() -> None:
    have = set(re.findall(r"\bfloat (f_\w+)\(", assets.text("functions.glsl")))
    called = set(re.findall(r"\bf_\w+", " ".join(TEMPLATES.values())))
    assert called <= have
    assert not set(TEMPLATES) & set(STRUCTURE)


def test_all_files_of_the_page_are_in_it() -> None:
    folder = Path(assets.__file__).parent / "assets"
    assert {f.stem for f in folder.glob("*.js")} == set(assets.MODULES)
    assert {f.stem for f in folder.glob("*.glsl")} == set(assets.SHADERS)
    joined = assets.script() + assets.text("viewer.css") + assets.text("viewer.html")
    assert "import " not in re.sub(r"//.*", "", joined)
    # An address of the SVG or GL kind would be no request, but there is none either.
    assert "http" not in joined


def test_large_files_are_thinned_but_for_the_plane_of_incidence() -> None:
    many = 40_000
    rng = np.random.default_rng(1)
    phi = rng.uniform(0.5, 3.0, many)
    phi[::100] = np.pi
    theta = rng.uniform(0.2, 1.4, many)
    value = np.ones((many, 31))
    m = Measurement(
        np.full(many, 0.5), np.zeros(many), theta, phi, value=value,
        valid=np.ones(value.shape, bool),
        channels=tuple(Channel(f"{w} nm", float(w)) for w in range(400, 710, 10)),
        symmetry="isotropic",
    )  # fmt: skip
    page = packed(m, ("front",))
    assert page["of"] == many
    assert page["rows"] == MOST_NUMBERS // 35
    angles = np.frombuffer(base64.b64decode(page["angles"]), "<f4").reshape(-1, 4)
    assert np.count_nonzero(angles[:, 3] == np.float32(np.pi)) == many // 100
