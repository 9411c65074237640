"""A lobe from outside: from a file of the user's, and from an installed package."""

from __future__ import annotations

import importlib.metadata
import os
import textwrap
from pathlib import Path

import numpy as np
import pytest
import synthetic

import fitting.models
from fitting import ModelError, fit, load_result
from fitting.cli import main
from fitting.model import Model
from fitting.models import lobe_class

VELVET = '''
"""Velvet: brightens towards grazing angles, like cloth."""

import jax.numpy as jnp

from fitting.models import Lobe
from fitting.parameters import coefficient, shape


class Velvet(Lobe):
    """``f = sheen ((1 - cos_i) (1 - cos_o))^power``."""

    NAME = "velvet"
    REFERENCE = "none"
    RECIPROCAL = True
    LINEAR = True
    ALBEDO_BOUND = None

    def parameters(self):
        return (
            shape("power", 1.0, (0.5, 8.0), "how near to grazing the sheen is"),
            coefficient("sheen", 0.1, "value at grazing", unit="1/sr"),
        )

    def basis(self, shape, geometry):
        g = geometry
        away = (1 - g.cos_i) * (1 - g.cos_o)
        some = g.reflects & (away > 0)
        logarithm = jnp.log(jnp.where(some, away, 1.0))
        return (jnp.where(some, jnp.exp(shape["power"] * logarithm), 0.0),)

    def amplitudes(self, shape, coefficients):
        return coefficients

    def peak(self, shape):
        return None
'''


@pytest.fixture
def velvet(tmp_path) -> Path:
    path = tmp_path / "velvet.py"
    path.write_text(textwrap.dedent(VELVET))
    return path


def test_a_lobe_of_ones_own_is_fitted_like_any_other(velvet, tmp_path):
    expression = f"lambert + {velvet}"
    truth = {"lambert.albedo": 0.2, "velvet.power": 2.0, "velvet.sheen": 0.5}
    data = synthetic.measurement(expression, truth)
    result = fit(data, expression, cross_validate=False)
    for name, value in truth.items():
        np.testing.assert_allclose(result.parameter(name).value, value, rtol=1e-6)
    path = tmp_path / "own.fit.json"
    result.save(path)
    angles = [a[:5] for a in synthetic.directions()]
    np.testing.assert_array_equal(
        load_result(path).evaluate(*angles), result.evaluate(*angles)
    )


def test_the_file_gives_one_class_until_it_changes(velvet):
    before = lobe_class(str(velvet))
    assert lobe_class(str(velvet)) is before
    assert Model(f"2*{velvet}").labels == ("velvet1", "velvet2")
    velvet.write_text(velvet.read_text().replace("8.0", "9.0"))
    os.utime(velvet, ns=(1, 1))
    after = lobe_class(str(velvet))
    assert after is not before
    assert after().parameters()[0].support == (0.5, 9.0)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("x = 1", "expected one class that is a Lobe, found none"),
        ("def f(:", "SyntaxError"),
        ("import nothing_of_this_name", "ModuleNotFoundError"),
        (
            "from fitting.models import Lobe\nclass A(Lobe):\n    NAME = 'a'",
            "does not say REFERENCE",
        ),
    ],
)
def test_a_file_that_holds_no_lobe(tmp_path, text: str, says: str):
    path = tmp_path / "wrong.py"
    path.write_text(text)
    with pytest.raises(ModelError, match=says):
        Model(f"lambert + {path}")


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(ModelError, match="No such file"):
        Model(str(tmp_path / "absent.py"))


def test_the_command_line_describes_it(velvet, capsys):
    assert main(["models", str(velvet)]) == 0
    out = capsys.readouterr().out
    assert "brightens towards grazing" in out
    assert "how near to grazing" in out


def test_an_installed_package_adds_a_lobe(velvet, monkeypatch):
    entry = importlib.metadata.EntryPoint("velvet", "package:Velvet", "fitting.models")
    monkeypatch.setattr(type(entry), "load", lambda _: lobe_class(str(velvet)))

    def entry_points(group: str, name: str | None = None):
        known = group == "fitting.models" and name in (None, "velvet")
        return (entry,) if known else ()

    monkeypatch.setattr(importlib.metadata, "entry_points", entry_points)
    monkeypatch.setattr("fitting.models.entry_points", entry_points)
    # What is installed does not change while a program runs, but here it does.
    monkeypatch.setattr("fitting.models._installed", fitting.models._installed.__wrapped__)
    assert Model("lambert + velvet").parameters()["velvet.power"].default == 1.0
