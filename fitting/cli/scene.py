"""``brdf scene``: which scenes there are, what one amounts to, what may stand in one."""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from fitting.cli.failures import UsageError
from fitting.cli.flags import DebugFlag, Json

if TYPE_CHECKING:
    from fitting.scene.explain import Explanation


def scene(
    name_or_file: Annotated[
        str | None, Parameter(help="A preset, or a scene file of your own, to explain it.")
    ] = None,
    /,
    *,
    fields: Annotated[
        bool,
        Parameter(
            negative="", show_default=False, help="Everything that may stand in a scene."
        ),
    ] = False,
    write: Annotated[
        Path | None,
        Parameter(help="Copy the preset to this file, with comments, to change it."),
    ] = None,
    force: Annotated[
        bool,
        Parameter(
            negative="", show_default=False, help="Overwrite the target if it exists."
        ),
    ] = False,
    json: Json = False,
    flags: DebugFlag | None = None,
) -> int:
    """List the scenes, or explain one in words and numbers."""
    if fields:
        if name_or_file is not None or write is not None:
            raise UsageError("--fields stands alone: brdf scene --fields")
        _fields(json)
    elif write is not None:
        _write(name_or_file, write, force)
    elif name_or_file is None:
        _list(json)
    else:
        _explain(name_or_file, json)
    return 0


def _list(json: bool) -> None:
    from fitting.cli.terminal import stdout, table
    from fitting.scene.load import PRESETS, load_scene

    scenes = [load_scene(name) for name in PRESETS]
    if json:
        _print_json([{"name": s.name, "description": s.description} for s in scenes])
        return
    rows = table("scene", "lights", "tolerance", "what it stands for", left=4)
    for s in scenes:
        lights = ", ".join(light.name for light in s.lights)
        kept = next(n for n in s.tolerance.__struct_fields__ if getattr(s.tolerance, n))
        rows.add_row(s.name, lights, kept.replace("_", " "), s.description)
    out = stdout()
    out.print(rows)
    out.print(
        "\nOne scene in full: brdf scene NAME. One of your own: brdf scene NAME --write "
        "my_scene.toml, change it, and give the file instead of the name.",
        style="dim",
    )


def _explain(name_or_file: str, json: bool) -> None:
    from fitting.cli.terminal import bullet, heading, stdout, table
    from fitting.quantities import percent
    from fitting.scene.explain import explain
    from fitting.scene.load import load_scene

    found = explain(load_scene(name_or_file))
    if json:
        import msgspec

        _print_json(msgspec.to_builtins(found))
        return
    out = stdout()
    said = f": {found.description}" if found.description else ""
    out.print(f"{found.name}{said}", style="bold")
    out.print(heading("Lights"))
    rows = table("light", "share", "size", "smallest alpha", "what it is", left=1)
    rows.columns[-1].justify = "left"
    for light in found.lights:
        rows.add_row(
            light.name,
            percent(light.share),
            "0" if light.size_deg == 0 else f"{light.size_deg:.3g} deg",
            "any" if light.size_deg == 0 else f"{light.smallest_alpha:.2g}",
            light.what,
        )
    out.print(rows)
    bullet(out, "share: of the illuminance on " + _surface(found))
    bullet(out, _sharpness(found))
    out.print(heading("Viewer"))
    bullet(out, f"sees {found.seen}")
    bullet(out, found.viewer)
    bullet(out, f"exposure {found.exposure}")
    out.print(heading("Tolerance"))
    bullet(out, found.tolerance)


def _surface(found: Explanation) -> str:
    kind = found.scene["seen"]["kind"]
    if kind == "flat":
        return "the flat sample"
    if kind == "histogram":
        return "a sample that faces the light"
    theta, phi = found.facing_deg
    return (
        f"the brightest part of a matt sphere, {theta:.0f} deg off the zenith, azimuth "
        f"{phi:.0f} deg"
    )


def _sharpness(found: Explanation) -> str:
    if found.smallest_alpha == 0:
        return "a light from one direction shows lobes of any width"
    return (
        f"as a rule, lobes much narrower than alpha = {found.smallest_alpha:.2g} (size / "
        "2.57 rad) differ only at the edges of highlights"
    )


def _fields(json: bool) -> None:
    from fitting.cli.terminal import bullet, stdout
    from fitting.scene.fields import sections

    found = sections()
    if json:
        import msgspec

        _print_json(msgspec.to_builtins(found))
        return
    out = stdout()
    out.print(
        "A scene is a file in TOML. Unknown keys are errors; paths are relative to it."
    )
    for section in found:
        out.print(f"\n{section.head}", style="bold")
        if section.meaning:
            out.print(section.meaning)
        for field in section.fields:
            default = "required" if field.default is None else f"default {field.default}"
            default = "" if field.default == "" else f"; {default}"
            bullet(out, f"{field.key}: {field.expected}{default}. {field.meaning}")


def _write(name: str | None, target: Path, force: bool) -> None:
    from fitting.cli.assignments import nearest
    from fitting.cli.terminal import stdout
    from fitting.scene.load import PRESETS, preset_text

    if name not in PRESETS:
        raise UsageError(
            f"--write copies a preset, not {name!r}{nearest(name or '', PRESETS)}"
        )
    if target.exists() and not force:
        raise UsageError(f"{target}: exists; overwrite it with --force")
    if not target.parent.is_dir():
        raise UsageError(f"{target}: the folder {target.parent} does not exist")
    handle, beside = tempfile.mkstemp(dir=target.parent, prefix=target.name)
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.write(preset_text(name))
        os.chmod(beside, 0o644)
        os.replace(beside, target)
    except BaseException:
        Path(beside).unlink(missing_ok=True)
        raise
    stdout().print(f"{target}: the preset {name}; see what it means: brdf scene {target}")


def _print_json(plain: object) -> None:
    import json

    sys.stdout.write(json.dumps(plain, indent=1, allow_nan=False) + "\n")
