"""Which variants of a lobe are exercised: a lobe with a choice of its options."""

from __future__ import annotations

import contextlib
import dataclasses
import itertools
from dataclasses import dataclass
from typing import Any

from fitting.expression import OPTIONS, ModelError, Term, options_of
from fitting.model import Model
from fitting.models import Lobe, lobe_class, lobe_names
from fitting.models.retro import Retro
from fitting.parameters import Parameter


@dataclass(frozen=True)
class Variant:
    """A lobe under the name that it has in tables, such as ``ggx(aniso)``.

    ``expression`` is what writes it in a model, or None if no expression knows it.
    """

    name: str
    lobe: Lobe
    expression: str | None = None

    def __str__(self) -> str:
        return self.name

    def __reduce__(self) -> tuple:
        # A lobe that was read from a file has a class that other processes cannot find.
        if self.expression is not None:
            return of_expression, (self.expression,)
        return Variant, (self.name, self.lobe)

    @property
    def shapes(self) -> tuple[Parameter, ...]:
        """Everything that enters nonlinearly, known (``given``) parameters included."""
        return tuple(p for p in self.lobe.parameters() if not p.coefficient)

    @property
    def model(self) -> Model:
        """The lobe as a model of one term."""
        if self.expression is not None:
            return Model(self.expression)
        # No expression leads here, so that the model is put together by hand.
        model = object.__new__(Model)
        core = self.core
        for field, value in (
            ("lobes", (self.lobe,)),
            ("labels", (core.NAME,)),
            ("expression", core.NAME),
        ):
            object.__setattr__(model, field, value)
        return model

    @property
    def core(self) -> Lobe:
        """The lobe inside of what turns it around."""
        return self.lobe.inner if isinstance(self.lobe, Retro) else self.lobe

    @property
    def turned(self) -> bool:
        """Whether the source is turned before the lobe is evaluated."""
        return isinstance(self.lobe, Retro)

    @property
    def options(self) -> dict[str, Any]:
        """The options by field."""
        core = self.core
        return {f.name: getattr(core, f.name) for f in dataclasses.fields(core)}


def of_expression(expression: str) -> Variant:
    """The variant that one term writes. Raises `ModelError` for anything else."""
    model = Model(expression)
    if len(model.lobes) != 1:
        raise ModelError(f"{expression!r} has {len(model.lobes)} lobes; expected one")
    return Variant(model.expression, model.lobes[0], model.expression)


def of_name(name: str, *, combined: bool = False) -> list[Variant]:
    """The default of a lobe and every other option alone.

    ``combined`` adds ``aniso`` together with each of the others that it goes with.
    """
    cls = lobe_class(name)
    # A lobe turned over is the same one; that turning is right is tested once.
    others = [o for o in options_of(cls) if o != "back" and not _is_default(cls, o)]
    found = [of_expression(str(Term(name, c))) for c in ((), *((o,) for o in others))]
    if combined and "aniso" in others:
        for pair in itertools.combinations(others, 2):
            # Options that exclude each other make no variant.
            with contextlib.suppress(ModelError):
                if "aniso" in pair:
                    found.append(of_expression(str(Term(name, pair))))
    return found


def registered(*, combined: bool = False) -> list[Variant]:
    """The variants of all lobes that there are."""
    return [v for n in lobe_names() for v in of_name(n, combined=combined)]


def of_lobe(lobe: Lobe) -> Variant:
    """A lobe from anywhere, with the options that it was made with."""
    core = lobe.inner if isinstance(lobe, Retro) else lobe
    words = [
        f"{f.name}={getattr(core, f.name)}"
        for f in dataclasses.fields(core)
        if getattr(core, f.name) != f.default
    ]
    if core is not lobe:
        words.append("retro")
    return Variant(f"{core.NAME}({', '.join(words)})" if words else core.NAME, lobe)


def _is_default(cls: type[Lobe], option: str) -> bool:
    field, value = OPTIONS[option]
    fields = cls.__dataclass_fields__
    return field in fields and fields[field].default == value
