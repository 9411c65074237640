"""What may stand in a scene file, read off `fitting.scene.description`."""

from __future__ import annotations

import inspect
from functools import cache
from typing import Any

import msgspec
from msgspec import Struct
from msgspec import inspect as types

from fitting.scene.description import Scene


class Field(Struct, frozen=True):
    """One key: what it expects, its default and its meaning.

    The default is null for a key that must be given, and empty for one that may be absent.
    """

    key: str
    expected: str
    default: str | None
    meaning: str


class Section(Struct, frozen=True):
    """One table of a scene file, and the line of TOML that begins it."""

    head: str
    meaning: str
    fields: list[Field]


def sections() -> list[Section]:
    """Every table that a scene file may have, the file itself first."""
    out: list[Section] = []
    _describe(scene_type(), "", out)
    return out


@cache
def scene_type() -> types.StructType:
    """What msgspec knows of the definition of a scene."""
    return structs(types.type_info(Scene))[0]


def expected(kind: types.Type) -> str:
    """What a value must be, in words: ``a number from 0 to 180 (deg)``."""
    unit = ""
    while isinstance(kind, types.Metadata):
        unit = unit or (f" ({kind.extra['unit']})" if kind.extra else "")
        kind = kind.type
    if isinstance(kind, types.FloatType | types.IntType):
        return ("an integer" if isinstance(kind, types.IntType) else "a number") + (
            _range(kind) + unit
        )
    if isinstance(kind, types.LiteralType):
        return " or ".join(map(_quoted, kind.values))
    if isinstance(kind, types.UnionType):
        parts = [expected(t) for t in kind.types if not isinstance(t, types.NoneType)]
        return " or ".join(dict.fromkeys(parts)) + unit
    if isinstance(kind, types.TupleType):
        parts = [expected(t) for t in kind.item_types]
        if len(set(parts)) == 1:
            return (
                f"{len(parts)} {parts[0].removeprefix('a ').replace('number', 'numbers')}"
            )
        return f"[{', '.join(parts)}]"
    if isinstance(kind, types.VarTupleType):
        return f"a list of one or more, each {expected(kind.item_type)}"
    if isinstance(kind, types.StructType):
        return "a table"
    return {types.StrType: "text", types.BoolType: "true or false"}.get(
        type(kind), type(kind).__name__
    )


def unwrapped(kind: types.Type) -> types.Type:
    """The type without what is said about it."""
    while isinstance(kind, types.Metadata):
        kind = kind.type
    return kind


def structs(kind: types.Type) -> list[types.StructType]:
    """The tables that a value of this type may be, or may hold."""
    kind = unwrapped(kind)
    if isinstance(kind, types.StructType):
        return [kind]
    if isinstance(kind, types.UnionType):
        return [s for t in kind.types for s in structs(t)]
    return structs(kind.item_type) if isinstance(kind, types.VarTupleType) else []


def _describe(kind: types.Type, path: str, out: list[Section]) -> None:
    """The tables that may stand at a path; what all of them have is said once."""
    tables = structs(kind)
    many = isinstance(unwrapped(kind), types.VarTupleType)
    head = f"[[{path}]]" if many else f"[{path}]" if path else "at the top of the file"
    first = tables[0]
    shared = [f for f in first.fields if all(f in t.fields for t in tables[1:])]
    if len(tables) > 1:
        kinds = " or ".join(_quoted(t.tag) for t in tables)
        said = "What it is; the other keys depend on it."
        common = [Field(str(first.tag_field), kinds, None, said), *map(_field, shared)]
        out.append(Section(head, "", common))
    for table in tables:
        text = " ".join((inspect.getdoc(table.cls) or "").replace("``", "").split())
        if len(tables) == 1:
            out.append(Section(head, text, [_field(f) for f in table.fields]))
        else:
            own = [_field(f) for f in table.fields if f not in shared]
            out.append(
                Section(f"{head} {table.tag_field} = {_quoted(table.tag)}", text, own)
            )
    seen: set[str] = set()
    for f in (f for table in tables for f in table.fields):
        if structs(f.type) and f.encode_name not in seen:
            seen.add(f.encode_name)
            _describe(f.type, f"{path}.{f.encode_name}".lstrip("."), out)


def meaning(field: types.Field) -> str:
    """The sentence that is said of a key where it is defined."""
    said: dict[str, Any] = {}
    if isinstance(field.type, types.Metadata):
        said = field.type.extra_json_schema or {}
    return str(said["description"])


def _field(field: types.Field) -> Field:
    default = None if field.required else _default(field)
    return Field(field.encode_name, expected(field.type), default, meaning(field))


def _default(field: types.Field) -> str:
    if field.default_factory is not msgspec.NODEFAULT:
        return ""
    value = field.default
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple):
        return "[" + ", ".join(f"{v:g}" for v in value) + "]"
    if value is None:
        return ""
    return _quoted(value) if isinstance(value, str) else f"{value:g}"


def _quoted(text: object) -> str:
    """As TOML writes it."""
    return f'"{text}"'


def _range(kind: types.FloatType | types.IntType) -> str:
    if kind.ge is not None and kind.le is not None:
        return f" from {kind.ge:g} to {kind.le:g}"
    if kind.gt is not None:
        return f" above {kind.gt:g}"
    return f" not below {kind.ge:g}" if kind.ge is not None else ""
