"""``brdf models``: which lobes a model can be made of."""

from __future__ import annotations

import inspect
import math
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from fitting.cli.failures import UsageError
from fitting.cli.flags import DebugFlag

if TYPE_CHECKING:
    from rich.console import Console

    from fitting.models import Lobe
    from fitting.parameters import Parameter as FitParameter


def models(
    name: Annotated[str | None, Parameter(help="Of a lobe, to describe it.")] = None,
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
    from fitting.models import lobe_class

    rows = table("lobe", "parameters", "reciprocal", "albedo", "what it is", left=5)
    for name in _names():
        lobe = lobe_class(name)
        rows.add_row(
            name,
            ", ".join(p.name for p in lobe().parameters()),
            "yes" if lobe.RECIPROCAL else "no",
            "no bound" if lobe.ALBEDO_BOUND is None else f"<= {lobe.ALBEDO_BOUND:g}",
            _first_line(lobe),
        )
    out.print(rows)
    out.print(
        "\nA model is a sum of lobes: 'lambert + ggx', 'eon + 2*ggx(aniso)'. albedo: of "
        "the lobe with its coefficients at 1. One lobe in full: brdf models NAME",
        style="dim",
    )


def _describe(out: Console, name: str) -> None:
    from fitting.cli.assignments import nearest
    from fitting.cli.terminal import bullet, heading
    from fitting.expression import OPTIONS, options_of
    from fitting.models import lobe_class

    if name not in _names():
        raise UsageError(f"there is no lobe {name!r}{nearest(name, _names())}")
    lobe = lobe_class(name)
    out.print(f"{name}: {_first_line(lobe)}", style="bold")
    out.print()
    out.print(inspect.cleandoc(lobe.__doc__ or "").replace("``", ""))
    out.print(heading("Parameters"))
    _parameters(out, lobe)
    options = options_of(lobe)
    if options:
        out.print(heading("Options"))
        for option in options:
            field, value = OPTIONS[option]
            default = lobe.__dataclass_fields__[field].default == value
            said = f"{name}({option})" + (", the default" if default else "")
            bullet(out, said)
            if not default:
                _parameters(out, lobe, **{field: value})
    out.print(heading("Facts"))
    bullet(out, "reciprocal" if lobe.RECIPROCAL else "not reciprocal")
    if lobe.ALBEDO_BOUND is None:
        bullet(out, "its albedo has no bound, so --energy hard is not possible")
    else:
        bullet(out, f"albedo at most {lobe.ALBEDO_BOUND:g} with its coefficients at 1")
    bullet(out, f"reference: {lobe.REFERENCE}")


def _parameters(out: Console, lobe: type[Lobe], **options: object) -> None:
    from fitting.cli.terminal import table

    rows = table("name", "support", "default", "unit", "per channel", "meaning", left=6)
    for p in lobe(**options).parameters():
        rows.add_row(
            p.name,
            _support(p),
            f"{p.default:g}",
            p.unit,
            "yes" if p.coefficient else "shared",
            p.meaning,
        )
    out.print(rows)


def _support(p: FitParameter) -> str:
    low, high = p.support
    text = f"{low:.4g} to {'infinity' if math.isinf(high) else f'{high:.4g}'}"
    return f"{text}, periodic" if p.scale == "periodic" else text


def _names() -> list[str]:
    from importlib.metadata import entry_points

    from fitting.models import LOBES

    return [*LOBES, *(e.name for e in entry_points(group="fitting.models"))]


def _first_line(lobe: type[Lobe]) -> str:
    """The sentence at the top of the lobe's file, without its name."""
    module = inspect.getmodule(lobe)
    line = ((module.__doc__ if module else "") or "").strip().partition("\n")[0]
    return (line.partition(": ")[2] or line).rstrip(".")
