"""What is wrong with a scene file, in one sentence: the key, what is found and expected."""

from __future__ import annotations

import difflib
import math
from collections.abc import Sequence
from typing import Any

import msgspec
from msgspec import inspect as types

from fitting.scene.description import Scene, SceneError
from fitting.scene.fields import expected, meaning, scene_type, structs, unwrapped


def checked(plain: dict[str, Any]) -> Scene:
    """The scene that a TOML file holds. Raises `SceneError`, without the file's name."""
    _table(plain, scene_type(), "")
    try:
        return msgspec.convert(plain, Scene)
    except msgspec.ValidationError as error:
        # What a definition itself refuses, with msgspec's way of saying where.
        said, _, at = str(error).partition(" - at `$")
        where = at.rstrip("`").lstrip(".")
        raise SceneError(f"{where}: {said}" if where else said) from error


def suggestion(name: str, known: Sequence[str]) -> str:
    """``; did you mean ...?``, or the names there are."""
    near = difflib.get_close_matches(name.lower(), known, n=1, cutoff=0.5)
    return f"; did you mean {near[0]}?" if near else f"; expected {_listed(known)}"


def _value(value: Any, kind: types.Type, path: str) -> None:
    bare = unwrapped(kind)
    union = bare.types if isinstance(bare, types.UnionType) else (bare,)
    alternatives = [unwrapped(t) for t in union]
    tables = structs(bare) if isinstance(value, dict) else []
    lists = [t for t in alternatives if isinstance(t, types.TupleType | types.VarTupleType)]
    if tables:
        _table(value, _chosen(value, tables, path), path)
    elif lists and isinstance(value, list):
        _list(value, kind, lists[0], path)
    elif not any(_is(value, t) for t in alternatives):
        raise SceneError(f"{path} is {_shown(value)}; expected {expected(kind)}")


def _list(
    value: list[Any],
    kind: types.Type,
    bare: types.TupleType | types.VarTupleType,
    path: str,
) -> None:
    if isinstance(bare, types.VarTupleType):
        items: Sequence[types.Type] = [bare.item_type] * len(value)
        wrong = len(value) < (bare.min_length or 0)
    else:
        items = bare.item_types
        wrong = len(value) != len(items)
    if wrong:
        raise SceneError(f"{path} has {len(value)} entries; expected {expected(kind)}")
    for i, (item, of) in enumerate(zip(value, items, strict=True)):
        _value(item, of, f"{path}[{i}]")


def _chosen(
    value: dict[str, Any], tables: Sequence[types.StructType], path: str
) -> types.StructType:
    """The table that the key of its kind names."""
    tag = tables[0].tag_field
    if tag is None:
        return tables[0]
    kinds = {str(t.tag): t for t in tables}
    where = f"{path}.{tag}"
    if tag not in value:
        raise SceneError(f"{where} is missing; expected {_listed(list(kinds))}")
    found = value[tag]
    if not isinstance(found, str) or found not in kinds:
        hint = suggestion(str(found), list(kinds))
        raise SceneError(f"{where} is {_shown(found)}{hint}")
    return kinds[found]


def _table(value: dict[str, Any], kind: types.StructType, path: str) -> None:
    fields = {f.encode_name: f for f in kind.fields}
    known = [*([kind.tag_field] if kind.tag_field else []), *fields]
    prefix = f"{path}." if path else ""
    of = f" of a {kind.tag}" if kind.tag else ""
    for key in value:
        if key not in known:
            raise SceneError(f"{prefix}{key} is no key{of}{suggestion(key, known)}")
    for name, field in fields.items():
        if name in value:
            _value(value[name], field.type, f"{prefix}{name}")
        elif field.required:
            said = f"{expected(field.type)}: {meaning(field).rstrip('.')}"
            raise SceneError(f"{prefix}{name} is missing; expected {said}")


def _is(value: Any, kind: types.Type) -> bool:
    """Whether a value that is no table and no list is of a type and in its range."""
    kind = unwrapped(kind)
    if isinstance(kind, types.LiteralType):
        return isinstance(value, str) and value in kind.values
    if isinstance(kind, types.StrType):
        return isinstance(value, str)
    if isinstance(kind, types.BoolType):
        return isinstance(value, bool)
    if not isinstance(kind, types.FloatType | types.IntType):
        return False
    wanted = int | float if isinstance(kind, types.FloatType) else int
    if isinstance(value, bool) or not isinstance(value, wanted):
        return False
    # A TOML file may say nan and inf.
    return (
        math.isfinite(value)
        and (kind.ge is None or value >= kind.ge)
        and (kind.gt is None or value > kind.gt)
        and (kind.le is None or value <= kind.le)
    )


def _shown(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict):
        return "a table"
    if isinstance(value, list):
        return f"a list of {len(value)}"
    return repr(value) if isinstance(value, str | int | float) else str(value)


def _listed(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} or {names[-1]}"
