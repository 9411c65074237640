"""``brdf models``: which lobes a model can be made of."""

from __future__ import annotations

import inspect
import math
from collections.abc import Collection
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from fitting.cli.failures import UsageError
from fitting.cli.flags import DebugFlag

if TYPE_CHECKING:
    from rich.console import Console

    from fitting.models import Lobe
    from fitting.parameters import Parameter as FitParameter


def models(
    name: Annotated[
        str | None, Parameter(help="Of a lobe, or the file of your own, to describe it.")
    ] = None,
    /,
    *,
    flags: DebugFlag | None = None,
) -> int:
    """List the models, or describe one in full."""
    from fitting.cli import jax_setup
    from fitting.cli.terminal import stdout

    jax_setup.set_up()
    out = stdout()
    if name is None:
        _list(out)
    else:
        _describe(out, name)
    return 0


def _list(out: Console) -> None:
    from fitting.cli.terminal import table
    from fitting.models import lobe_class, lobe_names

    rows = table("lobe", "light", "reciprocal", "albedo", "what it is", left=5)
    for name in lobe_names():
        lobe = lobe_class(name)
        rows.add_row(
            name,
            _light(lobe.WAYS),
            "yes" if lobe.RECIPROCAL else "no",
            "no bound" if lobe.ALBEDO_BOUND is None else f"<= {lobe.ALBEDO_BOUND:.4g}",
            _first_line(lobe),
        )
    out.print(rows)
    out.print(
        "\nA model is a sum of lobes: 'lambert + ggx', 'eon + 2*ggx(aniso)'. light: "
        "reflected (R) or transmitted (T). albedo: of "
        "the lobe with its coefficients at 1. One lobe in full: brdf models NAME",
        style="dim",
    )


_WAYS = {
    "front": "reflected at the front",
    "back": "reflected at the back",
    "down": "from front to back",
    "up": "from back to front",
}


def _light(ways: Collection[str]) -> str:
    """Whether a lobe reflects (R), transmits (T) or both."""
    reflects = "R" if {"front", "back"} & set(ways) else ""
    return reflects + ("T" if {"down", "up"} & set(ways) else "")


def _describe(out: Console, name: str) -> None:
    from fitting.cli.assignments import nearest
    from fitting.cli.terminal import bullet, heading
    from fitting.expression import MEANINGS, OPTIONS, options_of
    from fitting.models import lobe_class, lobe_names

    name = name.partition("(")[0].strip()
    if name not in lobe_names() and not name.endswith(".py"):
        raise UsageError(f"there is no lobe {name!r}{nearest(name, lobe_names())}")
    lobe = lobe_class(name)
    out.print(f"{lobe.NAME}: {_first_line(lobe)}", style="bold")
    out.print()
    out.print(inspect.cleandoc(lobe.__doc__ or "").replace("``", ""))
    out.print(heading("Parameters"))
    _parameters(out, lobe)
    options = options_of(lobe)
    if options:
        out.print(heading("Options"))
        usual = {p.name for p in lobe().parameters()}
        for option in options:
            field, value = OPTIONS[option]
            own = lobe.__dataclass_fields__.get(field)
            default = own is not None and own.default == value
            said = f"{option}: {MEANINGS[option]}" + (" (the default)" if default else "")
            bullet(out, said)
            if own is not None and not default:
                _parameters(out, lobe, usual, **{field: value})
    out.print(heading("Facts"))
    bullet(out, f"light: {', '.join(_WAYS[w] for w in lobe.WAYS)}")
    bullet(out, "reciprocal" if lobe.RECIPROCAL else "not reciprocal")
    if lobe.ALBEDO_BOUND is None:
        bullet(out, "its albedo has no bound, so --energy hard is not possible")
    else:
        bullet(out, f"albedo at most {lobe.ALBEDO_BOUND:g} with its coefficients at 1")
    bullet(out, f"reference: {lobe.REFERENCE}")


def _parameters(
    out: Console,
    lobe: type[Lobe],
    but: Collection[str] = (),
    **options: object,
) -> None:
    """A table of the parameters, but for those said before; nothing if none is left."""
    from fitting.cli.terminal import table

    listed = [p for p in lobe(**options).parameters() if p.name not in but]
    if not listed:
        return
    rows = table("name", "support", "default", "unit", "per channel", "meaning", left=6)
    for p in listed:
        rows.add_row(
            p.name,
            _support(p),
            f"{p.default:g}",
            p.unit,
            "yes" if p.coefficient else "known" if p.given else "shared",
            p.meaning,
        )
    out.print(rows)


def _support(p: FitParameter) -> str:
    low, high = p.support
    text = f"{low:.4g} to {'infinity' if math.isinf(high) else f'{high:.4g}'}"
    return f"{text}, periodic" if p.scale == "periodic" else text


def _first_line(lobe: type[Lobe]) -> str:
    """The sentence at the top of the lobe's file, without its name."""
    module = inspect.getmodule(lobe)
    line = ((module.__doc__ if module else "") or "").strip().partition("\n")[0]
    return (line.partition(": ")[2] or line).rstrip(".")
