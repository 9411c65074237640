"""What GLSL is generated from: numbers that the code has, and the two places for code.

Whatever depends on the parameters alone is computed once per change of a parameter, in the
block *prepare*; the block *evaluate* is run for every pair of directions and finds those
numbers in a row of a texture, by their slots.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

Index = tuple[str, ...]


class TranslationError(ValueError):
    """A model that GLSL cannot evaluate, with what stands in the way."""


@dataclass(eq=False)
class Block:
    """Lines of code, and what is already computed, by nested scopes of loops."""

    lines: list[str] = field(default_factory=list)
    scopes: list[dict] = field(default_factory=lambda: [{}])

    def add(self, line: str) -> None:
        """A line, indented as deep as the loops are."""
        self.lines.append("  " * len(self.scopes) + line)

    def found(self, key: object) -> str | None:
        """The variable that holds what was computed under a key, if it is in scope."""
        return next((s[key] for s in reversed(self.scopes) if key in s), None)


@dataclass(eq=False)
class Scalar:
    """A number: a literal, or a variable of one of the blocks.

    ``kind`` is its type in GLSL, ``known`` whether it depends on parameters only.
    """

    name: str
    kind: str
    known: bool
    literal: bool = False
    shape: tuple[int, ...] = ()


@dataclass(eq=False)
class Array:
    """Numbers that are computed when an element is asked for.

    ``element(block, index)`` writes what is needed into the block and returns an
    expression. ``place`` tells where they lie if that is a look-up and no work: in a
    variable of their own block, or in a constant that both see.
    """

    shape: tuple[int, ...]
    kind: str
    known: bool
    element: Callable[[Block, Index], str]
    place: Literal["", "variable", "constant"] = ""

    @property
    def size(self) -> int:
        return math.prod(self.shape)


Value = Scalar | Array


@dataclass(eq=False)
class Code:
    """The blocks, constants, and slots of what one block hands to the other."""

    prepare: Block = field(default_factory=Block)
    evaluate: Block = field(default_factory=Block)
    constants: list[str] = field(default_factory=list)
    handed: list[str] = field(default_factory=list)
    loads: list[str] = field(default_factory=list)
    slots: int = 0
    _names: int = 0
    _slot_of: dict[Value, int] = field(default_factory=dict)

    def name(self, letter: str = "v") -> str:
        """A name that is not taken."""
        self._names += 1
        return f"{letter}{self._names}"

    def block(self, known: bool) -> Block:
        """Where a value is computed."""
        return self.prepare if known else self.evaluate

    def emit(self, block: Block, kind: str, expression: str) -> str:
        """A new variable that holds an expression."""
        name = self.name()
        block.add(f"{kind} {name} = {expression};")
        return name

    def scalar(self, block: Block, value: Scalar) -> str:
        """How a block refers to a number."""
        if value.literal or not value.known or block is self.prepare:
            return value.name
        if value not in self._slot_of:
            slot = self.hand_over(value)
            loaded = _from_float(f"known({slot})", value.kind)
            self.loads.append(f"  {value.kind} {value.name} = {loaded};")
        return value.name

    def hand_over(self, value: Scalar) -> int:
        """Slot in which *prepare* leaves a number."""
        if value not in self._slot_of:
            self._slot_of[value] = self.slots
            self.handed.append(f"  known[{self.slots}] = {_to_float(value)};")
            self.slots += 1
        return self._slot_of[value]

    def at(self, block: Block, value: Value, index: Index) -> str:
        """How a block refers to an element; numbers are the same at every index."""
        if isinstance(value, Scalar):
            return self.scalar(block, value)
        if block is self.evaluate and value.known and value.place != "constant":
            slot = self._array_slots(value)
            flat = flat_index(value.shape, index)
            at = str(slot + int(flat)) if flat.isdigit() else f"{slot} + {flat}"
            return _from_float(f"known({at})", value.kind)
        return value.element(block, index)

    def _array_slots(self, value: Array) -> int:
        if value not in self._slot_of:
            first = self._slot_of[value] = self.slots
            self.slots += value.size
            with Loops(self, self.prepare, value.shape) as index:
                element = Scalar(value.element(self.prepare, index), value.kind, True)
                flat = flat_index(value.shape, index)
                self.prepare.add(f"known[{first} + {flat}] = {_to_float(element)};")
        return self._slot_of[value]

    def stored(self, value: Value) -> Value:
        """The same value, computed now and kept."""
        if isinstance(value, Scalar) or value.place:
            return value
        block, name = self.block(value.known), self.name("a")
        block.add(f"{value.kind} {name}[{value.size}];")
        with Loops(self, block, value.shape) as index:
            element = self.at(block, value, index)
            block.add(f"{name}[{flat_index(value.shape, index)}] = {element};")
        return kept(name, value.shape, value.kind, known=value.known)

    def constant(self, values: np.ndarray, kind: str) -> Value:
        """A constant: a literal, or an array that both blocks see."""
        if values.ndim == 0:
            return Scalar(literal(values.item(), kind), kind, True, literal=True)
        name = self.name("K")
        flat = ", ".join(literal(v, kind) for v in values.ravel().tolist())
        self.constants.append(
            f"const {kind} {name}[{values.size}] = {kind}[{values.size}]({flat});"
        )
        return Array(
            values.shape,
            kind,
            True,
            lambda block, index: f"{name}[{flat_index(values.shape, index)}]",
            "constant",
        )


def kept(name: str, shape: Sequence[int], kind: str, *, known: bool) -> Array:
    """An array that lies in a variable of its block."""
    whole = tuple(shape)

    def element(block: Block, index: Index) -> str:
        return f"{name}[{flat_index(whole, index)}]"

    return Array(whole, kind, known, element, "variable")


class Loops:
    """A context of nested loops over a shape; entering it gives the indices."""

    def __init__(self, code: Code, block: Block, shape: Sequence[int]):
        self._block = block
        self._shape = tuple(shape)
        self._index = tuple(code.name("i") for _ in self._shape)

    def __enter__(self) -> Index:
        for name, size in zip(self._index, self._shape, strict=True):
            self._block.add(f"for (int {name} = 0; {name} < {size}; ++{name}) {{")
            self._block.scopes.append({})
        return self._index

    def __exit__(self, *error: object) -> None:
        for _ in self._shape:
            self._block.scopes.pop()
            self._block.add("}")


def flat_index(shape: Sequence[int], index: Index) -> str:
    """Row-major position of an element, as a number where it is one."""
    terms: list[str] = []
    number, stride = 0, 1
    for size, i in zip(reversed(tuple(shape)), reversed(index), strict=True):
        if i.isdigit():
            number += stride * int(i)
        elif size > 1:
            terms.append(i if stride == 1 else f"{stride} * ({i})")
        stride *= size
    if number or not terms:
        terms.append(str(number))
    return " + ".join(reversed(terms))


def literal(value: float | int | bool, kind: str) -> str:
    """A number as GLSL writes it."""
    if kind == "bool":
        return "true" if value else "false"
    if kind == "int":
        return f"({int(value)})" if value < 0 else str(int(value))
    if math.isnan(value):
        return "uintBitsToFloat(0x7fc00000u)"
    if math.isinf(value):
        bits = "0x7f800000u" if value > 0 else "0xff800000u"
        return f"uintBitsToFloat({bits})"
    text = f"{float(np.float32(value)):.9g}"
    if "." not in text and "e" not in text:
        text += ".0"
    return f"({text})" if text.startswith("-") else text


def with_shape(value: Array, shape: Sequence[int], element: Callable) -> Array:
    """The same numbers under other indices."""
    return dataclasses.replace(value, shape=tuple(shape), element=element, place="")


def _from_float(expression: str, kind: str) -> str:
    return {
        "float": expression,
        "int": f"int({expression})",
        "bool": f"({expression} != 0.0)",
    }[kind]


def _to_float(value: Scalar) -> str:
    if value.kind == "float":
        return value.name
    return f"({value.name} ? 1.0 : 0.0)" if value.kind == "bool" else f"float({value.name})"
