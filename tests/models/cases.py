"""Every registered lobe with its options, and how thoroughly each is tested when."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import pytest

from fitting.expression import OPTIONS
from fitting.models import LOBES, Lobe, lobe_class
from fitting.stress import variants
from fitting.stress.variants import Variant


@dataclass(frozen=True)
class Case:
    """A lobe class with a choice of options by field."""

    name: str
    options: tuple[tuple[str, object], ...] = ()

    @property
    def lobe(self) -> Lobe:
        options: dict[str, Any] = dict(self.options)
        return lobe_class(self.name)(**options)


def _first_of_their_kind() -> Iterator[str]:
    """What the default run takes: every lobe, every anisotropic one, and every other
    option on the first lobe that has it, since its physics is shared."""
    seen: set[str] = set()
    for name in LOBES:
        for v in variants.of_name(name):
            option = v.name[len(name) + 1 : -1]
            if option in ("", "aniso") or option not in seen or option not in OPTIONS:
                yield v.name
            seen.add(option)


VARIANTS: list[Variant] = [v for n in LOBES for v in variants.of_name(n)]
_ALONE = {v.name for v in VARIANTS}
COMBINED: list[Variant] = [
    v for n in LOBES for v in variants.of_name(n, combined=True) if v.name not in _ALONE
]
_FIRST = set(_first_of_their_kind())
QUICK: list[Variant] = [v for v in VARIANTS if v.name in _FIRST]
# The tangent frame is one piece of code: every run looks at it where it reflects and where
# it refracts, the slow one with every lobe.
FEW: list[Variant] = [
    v
    for v in QUICK
    if "(aniso)" not in v.name or v.name in ("ggx(aniso)", "rough_dielectric(aniso)")
]
DEFAULTS: list[Variant] = [v for v in VARIANTS if v.name in LOBES]


def each(of: list[Variant]) -> pytest.MarkDecorator:
    """Parametrises a test over variants."""
    return pytest.mark.parametrize("variant", of, ids=str)


def default_and_slow(
    of: list[Variant], slow: list[Variant] = VARIANTS
) -> pytest.MarkDecorator:
    """All variants: some in the default run, others in the slow one, the rest in full."""
    quick, later = {v.name for v in of}, {v.name for v in slow}

    def marks(v: Variant) -> tuple[pytest.MarkDecorator, ...]:
        if v.name in quick:
            return ()
        return (pytest.mark.slow if v.name in later else pytest.mark.full,)

    marked = [pytest.param(v, marks=marks(v), id=str(v)) for v in VARIANTS]
    return pytest.mark.parametrize("variant", marked)
