"""Compiled functions that another process finds again, and when it must not."""

from __future__ import annotations

import zlib
from concurrent.futures import Future
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import synthetic
from jax.experimental import serialize_executable
from jax.experimental.compilation_cache import compilation_cache

from fitting import Model, fit, from_angles, kept_programs
from fitting.compiled import Compiled
from fitting.uncertainty import Covariance


class Somebodys(eqx.Module):
    """What is not of this package: its source may be another one tomorrow."""

    factor: float = eqx.field(static=True, default=2.0)


class Counted:
    """A function, and how often it was traced."""

    def __init__(self, function=None):
        self.traced = 0
        self._function = function or (lambda a, b, kind: a * b if kind == "*" else a + b)
        self.__module__, self.__qualname__ = __name__, "counted"
        self.__name__ = "counted"

    def __call__(self, *args):
        self.traced += 1
        return self._function(*args)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch):
    """Programs are kept in an empty folder."""
    monkeypatch.setattr(kept_programs, "_folder", tmp_path)
    return tmp_path


def _files(folder: Path) -> list[Path]:
    return sorted(folder.iterdir())


def test_the_next_process_does_not_trace(folder):
    a, b = np.arange(3.0, dtype=np.float32), jnp.asarray(2.0, dtype=jnp.float32)
    first = Counted()
    np.testing.assert_array_equal(Compiled(first, None)(a, b, "*"), [0, 2, 4])
    assert first.traced == 1
    assert len(_files(folder)) == 1
    # What another process has: the same function, nothing compiled, the folder.
    second = Counted()
    again = Compiled(second, None)
    np.testing.assert_array_equal(again(a + 1, b, "*"), [2, 4, 6])
    np.testing.assert_array_equal(again(a, b, "*"), [0, 2, 4])
    assert second.traced == 0


@pytest.mark.parametrize(
    "other",
    [
        (np.ones(2, np.float32), jnp.float32(2), "*"),
        (np.ones(3, np.int32), jnp.float32(2), "*"),
        (np.ones(3, np.float32), jnp.ones(1, jnp.float32), "*"),
        (np.ones(3, np.float32), jnp.float32(2), "+"),
        (np.ones(3, np.float32), 2.0, "*"),
        (np.ones(3, np.float32), 2, "*"),
    ],
    ids=["fewer", "integers", "other shape", "other word", "number", "whole number"],
)
def test_what_a_program_depends_on(folder, other):
    Compiled(Counted(), None)(np.ones(3, np.float32), jnp.float32(2), "*")
    counted = Counted()
    out = Compiled(counted, None)(*other)
    a, b, kind = other
    np.testing.assert_array_equal(out, a * b if kind == "*" else a + b)
    assert counted.traced == 1
    assert len(_files(folder)) == 2


def test_precision_is_part_of_it():
    def half(a):
        return a + jnp.asarray(0.1)

    a = np.ones(2, np.float32)
    for x64, kind in ((False, np.float32), (True, np.float64)):
        with jax.enable_x64(x64):
            counted = Counted(half)
            out = Compiled(counted, None)(a.astype(kind))
            assert out.dtype == kind
            assert counted.traced == 1


def test_compiler_options_are_part_of_it(folder):
    from fitting.row_sums import FAST

    for options in (None, FAST, None):
        Compiled(Counted(), options)(np.ones(2), np.ones(2), "+")
    assert len(_files(folder)) == 2


def test_results_keep_their_types():
    def solved(a, nothing):
        return Covariance(a, a + 1, a), nothing

    for _ in range(2):
        covariance, nothing = Compiled(Counted(solved), None)(np.ones(2), None)
        assert isinstance(covariance, Covariance)
        assert nothing is None
        np.testing.assert_array_equal(covariance.freedom, [2, 2])


@pytest.mark.parametrize("alpha", [0.2, [0.2, 0.21]], ids=["shared", "by channel"])
def test_bits_do_not_depend_on_whether_programs_are_kept(folder, monkeypatch, alpha):
    model = Model("lambert + ggx")
    geometry = from_angles(np.linspace(0, 1.5, 97), 0.0, np.linspace(1.4, 0, 97), 2.0)
    values = {n: np.full(2, v) for n, v in model.defaults().items()}
    values["ggx.alpha"] = np.asarray(alpha)

    def evaluated(model, values, geometry):
        return model(values, geometry)

    with jax.enable_x64(True):
        geometry = jax.tree.map(np.asarray, geometry)
        monkeypatch.setattr(kept_programs, "_folder", None)
        plain = Compiled(Counted(evaluated), None)(model, values, geometry)
        monkeypatch.setattr(kept_programs, "_folder", folder)
        for traced in (1, 0):
            counted = Counted(evaluated)
            kept = Compiled(counted, None)(model, values, geometry)
            np.testing.assert_array_equal(kept, plain)
            assert counted.traced == traced


def test_a_device_that_was_chosen_is_used(folder):
    device = jax.devices()[0]
    with jax.default_device(device):
        out = Compiled(Counted(), None)(np.ones(2), np.ones(2), "+")
    assert out.devices() == {device}
    assert not _files(folder)


def test_zero_has_a_sign():
    function = Compiled(Counted(lambda a, s: jnp.copysign(a, s)), None)
    assert function(np.ones(1), 0.0)[0] == 1
    assert function(np.ones(1), -0.0)[0] == -1


@pytest.fixture
def jax_keeps_all(tmp_path_factory):
    """JAX's own cache, empty at first, keeps whatever is compiled."""
    settings = {
        "jax_compilation_cache_dir": str(tmp_path_factory.mktemp("jax")),
        "jax_persistent_cache_min_compile_time_secs": 0.0,
    }
    before = {name: getattr(jax.config, name) for name in settings}
    compilation_cache.reset_cache()
    for name, value in settings.items():
        jax.config.update(name, value)
    yield
    for name, value in before.items():
        jax.config.update(name, value)
    compilation_cache.reset_cache()


@pytest.mark.usefixtures("jax_keeps_all")
def test_what_jax_has_kept_is_not_kept_again(folder, monkeypatch):
    """A program that JAX read from its own cache cannot be written any more."""
    for kept in (None, folder, None, folder, folder):
        monkeypatch.setattr(kept_programs, "_folder", kept)
        jax.clear_caches()
        out = Compiled(Counted(), None)(np.ones(2), np.ones(2), "+")
        np.testing.assert_array_equal(out, [2, 2])


@pytest.mark.usefixtures("jax_keeps_all")
def test_what_was_compiled_for_others_is_not_kept(folder):
    """Nor one with the same code as what is not kept, or was only looked into."""

    def run(own: object) -> None:
        jax.clear_caches()
        out = Compiled(Counted(lambda own, a: jnp.pad(a + a, 3)), None)(own, np.ones(2))
        np.testing.assert_array_equal(out, [0, 0, 0, 2, 2, 0, 0, 0])

    run(Somebodys())
    looked_into = Compiled(Counted(lambda own, a: jnp.pad(a + a, 3)), None)
    looked_into.lower((), np.ones(2)).compile()
    assert not _files(folder)
    for _ in range(3):
        run(())
    assert len(_files(folder)) == 1


def _turned(a):
    return jax.lax.fori_loop(0, 3, lambda i, v: jnp.sin(v) + v[::-1], jnp.pad(a + a, 3))


@pytest.mark.usefixtures("jax_keeps_all")
@pytest.mark.parametrize("size", [2, 300_000], ids=["at once", "later"])
def test_what_cannot_be_run_is_made_again(folder, size):
    """A program as a version of this package wrote it that took it from JAX's cache.

    Whether it says so when it is called, or when its results are looked at.
    """
    a = np.ones(size, np.float32)
    for _ in range(2):
        jax.clear_caches()
        from_jax = jax.jit(_turned).lower(a).compile()
    payload, *_ = serialize_executable.serialize(from_jax)
    expected = np.asarray(Compiled(Counted(_turned), None)(a))
    (path,) = _files(folder)
    head, _, _ = zlib.decompress(path.read_bytes()).partition(b"\n")
    path.write_bytes(zlib.compress(head + b"\n" + payload))
    jax.clear_caches()
    for traced in (1, 0):
        counted = Counted(_turned)
        again = Compiled(counted, None)
        for _ in range(2):
            np.testing.assert_array_equal(again(a), expected)
        assert counted.traced == traced


@pytest.mark.usefixtures("jax_keeps_all")
def test_what_is_not_kept_is_found_in_the_cache_of_jax(tmp_path_factory):
    """And does not fill it: it has one name."""
    found = []
    for _ in range(3):
        jax.clear_caches()
        Compiled(Counted(jnp.linalg.eigvalsh), None)(np.eye(2))
        cache = Path(jax.config.jax_compilation_cache_dir)  # pyright: ignore
        found.append(len([p for p in cache.iterdir() if "counted" in p.name]))
    assert found[0] == found[-1]


def test_what_went_wrong_is_tried_again():
    fails = iter((True, False))

    def wrong_at_first(a):
        if next(fails):
            raise RuntimeError("not now")
        return a + 1

    function = Compiled(Counted(wrong_at_first), None)
    function.begin(np.ones(2))
    with pytest.raises(RuntimeError, match="not now"):
        function(np.ones(2))
    np.testing.assert_array_equal(function(np.ones(2)), [2, 2])


@pytest.mark.parametrize("damage", ["cut", "empty", "another"])
def test_a_damaged_file_is_made_again(folder, damage):
    a = np.ones(2)
    Compiled(Counted(), None)(a, a, "+")
    (path,) = _files(folder)
    whole = path.read_bytes()
    if damage == "another":
        Compiled(Counted(), None)(a, a, "*")
        (other,) = set(_files(folder)) - {path}
        path.write_bytes(other.read_bytes())
    else:
        path.write_bytes(whole[: len(whole) // 2 if damage == "cut" else 0])
    counted = Counted()
    np.testing.assert_array_equal(Compiled(counted, None)(a, a, "+"), [2, 2])
    assert counted.traced == 1
    again = Counted()
    np.testing.assert_array_equal(Compiled(again, None)(a, a, "+"), [2, 2])
    assert again.traced == 0


def test_a_folder_that_is_gone(folder, monkeypatch):
    monkeypatch.setattr(kept_programs, "_folder", folder / "gone")
    np.testing.assert_array_equal(Compiled(Counted(), None)(np.ones(2), 2.0, "*"), [2, 2])
    assert not _files(folder)


def test_programs_of_other_packages_are_not_kept(folder):
    for _ in range(2):
        counted = Counted(lambda own, a: own.factor * a)
        out = Compiled(counted, None)(Somebodys(), np.ones(2))
        np.testing.assert_array_equal(out, [2, 2])
        assert counted.traced == 1
    assert not _files(folder)


def test_what_calls_other_code_is_not_kept(folder):
    counted = Counted(jnp.linalg.eigvalsh)
    np.testing.assert_allclose(Compiled(counted, None)(np.eye(2)), [1, 1])
    assert not _files(folder)


def test_within_another_compiled_function(folder):
    inner = Compiled(Counted(), None)
    out = jax.jit(lambda a: jax.grad(lambda x: jnp.sum(inner(x, x, "*")))(a))(np.ones(2))
    np.testing.assert_array_equal(out, [2, 2])
    assert not _files(folder)


def test_making_room(monkeypatch):
    from fitting import compiled

    counted = Counted()
    function = Compiled(counted, None)
    function(np.ones(2), np.ones(2), "+")
    monkeypatch.setattr(compiled, "_MANY", 0)
    monkeypatch.setattr(compiled.jax, "clear_caches", lambda: None)
    compiled.make_room()
    assert not function._ready
    np.testing.assert_array_equal(function(np.ones(2), np.ones(2), "+"), [2, 2])
    assert counted.traced == 1


def test_what_was_begun_is_not_traced_again():
    counted = Counted()
    function = Compiled(counted, None)
    stand_in = jax.ShapeDtypeStruct((2,), np.float32)
    for _ in range(2):
        function.begin(stand_in, stand_in, "+")
    ones = np.ones(2, np.float32)
    np.testing.assert_array_equal(function(ones, ones, "+"), [2, 2])
    assert counted.traced == 1


def test_what_goes_wrong_in_the_background_is_said_where_it_is_needed():
    def wrong(a):
        raise RuntimeError("no such thing")

    function = Compiled(Counted(wrong), None)
    function.begin(np.ones(2))
    with pytest.raises(RuntimeError, match="no such thing"):
        function(np.ones(2))


ALL = {"refine", "_noise_sums", "_moments", "_dense_albedo", "_evaluate"}


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        pytest.param({}, ALL, id="plain"),
        pytest.param({"robust": True}, {"refine"}, id="robust", marks=pytest.mark.slow),
        pytest.param(
            {"per_channel_shape": True},
            ALL - {"_evaluate"},
            id="per channel",
            marks=pytest.mark.slow,
        ),
    ],
)
def test_a_fit_uses_all_that_was_begun_for_it(monkeypatch, options, expected):
    begun: list[tuple[Compiled, object]] = []
    plainly = Compiled.begin

    def begin(self, *args, **kwargs):
        before = set(self._ready)
        plainly(self, *args, **kwargs)
        begun.extend((self, key) for key in set(self._ready) - before)

    monkeypatch.setattr(Compiled, "begin", begin)
    truth = {"lambert.albedo": [0.3, 0.2], "ggx.alpha": 0.2}
    truth |= {"ggx.f0": [0.05, 0.06], "ggx.f90": [1.0, 1.0]}
    data = synthetic.measurement("lambert + ggx", truth, relative=0.02)
    fit(data, "lambert + ggx", cross_validate=False, **options)
    assert {function.__name__ for function, _ in begun} == expected
    assert not any(isinstance(function._ready[key], Future) for function, key in begun)
    for function, _ in begun:
        function.forget()
