"""``brdf doctor``: does the installation work, and if not, what to do."""

from __future__ import annotations

import platform
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, version
from typing import NamedTuple

from fitting.cli import failures
from fitting.cli.flags import DebugFlag

_PACKAGES = ("jax", "jaxlib", "equinox", "optimistix", "numpy", "scipy", "h5py")


class Finding(NamedTuple):
    """One line: whether all is well, what was found, and what to do if not."""

    good: bool
    text: str
    advice: str = ""


def doctor(*, flags: DebugFlag | None = None) -> int:
    """Check that the installation works."""
    from fitting.cli import jax_setup
    from fitting.cli.terminal import stdout

    out = stdout()
    jax_setup.set_up()
    checks: dict[str, Callable[[], Finding]] = {
        "versions": _versions,
        "devices": _devices,
        "float64": _float64,
        "cache": _cache,
        "sample": _sample,
        "fit": _fit,
    }
    problems = 0
    for name, check in checks.items():
        try:
            found = check()
        except (ImportError, OSError, RuntimeError, ValueError) as error:
            text = f"{type(error).__name__}: {' '.join(str(error).split())[:200]}"
            found = Finding(False, text, "reinstall with `pip install --force-reinstall .`")
        problems += not found.good
        word = "ok     " if found.good else "problem"
        advice = f"; {found.advice}" if not found.good and found.advice else ""
        style = "" if found.good else "red"
        out.print(f"{word}  {name:9}{found.text}{advice}", style=style, soft_wrap=True)
    return failures.GOOD if not problems else failures.NOT_CONVERGED


def _versions() -> Finding:
    found, missing = [f"python {platform.python_version()}"], []
    for package in ("brdf-fitting", *_PACKAGES):
        try:
            found.append(f"{package} {version(package)}")
        except PackageNotFoundError:
            missing.append(package)
    text = ", ".join(found)
    if missing:
        return Finding(False, text, f"install {', '.join(missing)}")
    return Finding(True, text)


def _devices() -> Finding:
    import jax

    listed = ", ".join(f"{d.platform}:{d.id} {d.device_kind}" for d in jax.devices())
    return Finding(True, f"{listed} (JAX_PLATFORMS chooses)")


def _float64() -> Finding:
    import jax
    import jax.numpy as jnp

    with jax.enable_x64(True):
        step = float(jnp.asarray(1.0) + jnp.asarray(1e-12)) - 1.0
    if abs(step - 1e-12) < 1e-15:
        return Finding(True, "1 + 1e-12 is told from 1")
    return Finding(
        False, "1 + 1e-12 is not told from 1", "choose another device: JAX_PLATFORMS=cpu"
    )


def _cache() -> Finding:
    from fitting.cli import jax_setup

    folder = jax_setup.cache_folder()
    if folder is None:
        return Finding(
            True, f"off, since {jax_setup.OVERRIDE} is empty: every run compiles"
        )
    if not jax_setup.is_writable(folder):
        what = "what is not there yet" if folder.is_dir() else "everything"
        return Finding(
            False,
            f"{folder} cannot be written to, so every run compiles {what}",
            f"set {jax_setup.OVERRIDE} to a folder of yours",
        )
    size = sum(f.stat().st_size for f in folder.iterdir() if f.is_file())
    return Finding(True, f"{folder}, {size / 1e6:.1f} MB of compiled code")


def _sample() -> Finding:
    import data_formats
    from fitting.sample import sample_path

    measurement = data_formats.read(sample_path())
    return Finding(True, f"{measurement.n_rows} rows by {measurement.n_channels} channels")


def _fit() -> Finding:
    import time

    import data_formats
    from fitting.fitter import fit
    from fitting.sample import sample_path

    start = time.perf_counter()
    result = fit(
        data_formats.read(sample_path()), "lambert + ggx", cross_validate=False, starts=1
    )
    seconds = time.perf_counter() - start
    (alpha,) = result.parameter("ggx.alpha").value
    text = f"lambert + ggx, alpha = {alpha:.3f}, in {seconds:.1f} s with compiling"
    return Finding(result.solver.converged, text, "please report this")
