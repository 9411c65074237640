"""JAX's primitives about the shape of arrays, and sums over them, in GLSL.

A handler gets the code, the operands, the primitive's parameters, and shape and type of
what comes out.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from fitting.viewer.blocks import (
    Array,
    Block,
    Code,
    Index,
    Loops,
    Scalar,
    TranslationError,
    Value,
    flat_index,
    kept,
    with_shape,
)

Handler = Callable[[Code, Sequence[Value], dict[str, Any], tuple[int, ...], str], Value]


def _broadcast(code, operands, params, shape, kind) -> Value:
    (operand,) = operands
    if not shape or isinstance(operand, Scalar):
        return operand if not shape else _spread(code, operand, shape)
    axes = params["broadcast_dimensions"]

    def element(block: Block, index: Index) -> str:
        own = (
            "0" if size == 1 else index[axis]
            for size, axis in zip(operand.shape, axes, strict=True)
        )
        return code.at(block, operand, tuple(own))

    return with_shape(operand, shape, element)


def _spread(code: Code, operand: Scalar, shape: tuple[int, ...]) -> Array:
    return Array(
        shape, operand.kind, operand.known, lambda block, _: code.scalar(block, operand)
    )


def _reshape(code, operands, params, shape, kind) -> Value:
    operand = code.stored(operands[0])
    if isinstance(operand, Scalar):
        return _spread(code, operand, shape) if shape else operand
    if not shape:
        block = code.block(operand.known)
        element = code.at(block, operand, ("0",) * len(operand.shape))
        return Scalar(code.emit(block, kind, element), kind, operand.known)

    def element(block: Block, index: Index) -> str:
        return code.at(block, flat, (flat_index(shape, index),))

    flat = _flattened(code, operand)
    return with_shape(operand, shape, element)


def _flattened(code: Code, operand: Array) -> Array:
    """A stored array under its row-major position."""

    def element(block: Block, index: Index) -> str:
        rest, out = index[0], []
        for size in reversed(operand.shape):
            if rest.isdigit():
                out.append(str(int(rest) % size))
                rest = str(int(rest) // size)
            else:
                out.append(f"(({rest}) % {size})" if size > 1 else "0")
                rest = f"(({rest}) / {size})" if size > 1 else rest
        return code.at(block, operand, tuple(reversed(out)))

    return with_shape(operand, (operand.size,), element)


def _slice(code, operands, params, shape, kind) -> Value:
    operand = code.stored(operands[0])
    strides = params["strides"] or (1,) * len(shape)
    starts = params["start_indices"]

    def element(block: Block, index: Index) -> str:
        own = (
            _affine(i, start, step)
            for i, start, step in zip(index, starts, strides, strict=True)
        )
        return code.at(block, operand, tuple(own))

    return with_shape(operand, shape, element)


def _affine(index: str, start: int, step: int) -> str:
    if index.isdigit():
        return str(start + step * int(index))
    scaled = index if step == 1 else f"{step} * ({index})"
    return f"{start} + {scaled}" if start else scaled


def _transpose(code, operands, params, shape, kind) -> Value:
    (operand,) = operands
    order = params["permutation"]

    def element(block: Block, index: Index) -> str:
        own = [""] * len(order)
        for place, axis in zip(index, order, strict=True):
            own[axis] = place
        return code.at(block, operand, tuple(own))

    return with_shape(operand, shape, element)


def _concatenate(code, operands, params, shape, kind) -> Value:
    axis, known = params["dimension"], all(o.known for o in operands)
    block, name = code.block(known), code.name("a")
    block.add(f"{kind} {name}[{math.prod(shape)}];")
    start = 0
    for operand in operands:
        with Loops(code, block, operand.shape) as index:
            place = (*index[:axis], f"{start} + {index[axis]}", *index[axis + 1 :])
            value = code.at(block, operand, index)
            block.add(f"{name}[{flat_index(shape, place)}] = {value};")
        start += operand.shape[axis]
    return kept(name, shape, kind, known=known)


def _iota(code, operands, params, shape, kind) -> Value:
    along = np.arange(shape[params["dimension"]])
    wide = [-1 if k == params["dimension"] else 1 for k in range(len(shape))]
    return code.constant(np.broadcast_to(along.reshape(wide), shape), kind)


def _reduce(start: str, step: str) -> Handler:
    def handler(code, operands, params, shape, kind) -> Value:
        (operand,) = operands
        axes, block = params["axes"], code.block(operand.known)
        if isinstance(operand, Scalar):
            return operand
        if kind != "float":
            raise TranslationError(f"a sum or an extreme of numbers of the type {kind}")
        inner = tuple(operand.shape[a] for a in axes)

        def total(outer: Index) -> str:
            name, left = code.name("s"), code.name("c")
            block.add(f"{kind} {name} = {start}, {left} = 0.0;")
            with Loops(code, block, inner) as index:
                of_axis = dict(zip(axes, index, strict=True))
                rest = iter(outer)
                whole = tuple(
                    of_axis[a] if a in of_axis else next(rest)
                    for a in range(len(operand.shape))
                )
                element = code.at(block, operand, whole)
                block.add(step.format(name, left, element))
            return name

        return _for_each(code, block, shape, kind, operand.known, total)

    return handler


def _dot(code, operands, params, shape, kind) -> Value:
    """Products summed over the contracted axes; batch axes are not known."""
    left, right = operands
    (over_left, over_right), (batch, _) = params["dimension_numbers"]
    if batch:
        raise TranslationError("a product of batches of matrices, which is not known")
    known = left.known and right.known
    block = code.block(known)
    free = [a for a in range(len(left.shape)) if a not in over_left]

    def total(outer: Index) -> str:
        name, rest = code.name("s"), code.name("c")
        block.add(f"{kind} {name} = 0.0, {rest} = 0.0;")
        with Loops(code, block, [left.shape[a] for a in over_left]) as index:
            at_left = _placed(len(left.shape), over_left, index, outer[: len(free)])
            at_right = _placed(len(right.shape), over_right, index, outer[len(free) :])
            product = f"{code.at(block, left, at_left)} * {code.at(block, right, at_right)}"
            block.add(f"f_add({name}, {rest}, {product});")
        return name

    return _for_each(code, block, shape, kind, known, total)


def _placed(count: int, over: Sequence[int], inner: Index, outer: Index) -> Index:
    contracted, rest = dict(zip(over, inner, strict=True)), iter(outer)
    return tuple(contracted[a] if a in contracted else next(rest) for a in range(count))


def _for_each(
    code: Code, block: Block, shape: tuple[int, ...], kind: str, known: bool,
    total: Callable[[Index], str],
) -> Value:  # fmt: skip
    """A sum, or one for every element of a shape."""
    if not shape:
        return Scalar(total(()), kind, known)
    name = code.name("a")
    block.add(f"{kind} {name}[{math.prod(shape)}];")
    with Loops(code, block, shape) as index:
        block.add(f"{name}[{flat_index(shape, index)}] = {total(index)};")
    return kept(name, shape, kind, known=known)


STRUCTURE: dict[str, Handler] = {
    "broadcast_in_dim": _broadcast,
    "reshape": _reshape,
    "squeeze": _reshape,
    "expand_dims": _reshape,
    "slice": _slice,
    "transpose": _transpose,
    "concatenate": _concatenate,
    "iota": _iota,
    "reduce_sum": _reduce("0.0", "f_add({0}, {1}, {2});"),
    "reduce_max": _reduce("(-3.4e38)", "{0} = max({0}, {2});"),
    "reduce_min": _reduce("3.4e38", "{0} = min({0}, {2});"),
    "reduce_prod": _reduce("1.0", "{0} *= {2};"),
    "dot_general": _dot,
}
