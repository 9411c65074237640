"""JAX's primitives in GLSL: a function for each, by name.

Of most a template of their operands will do; `STRUCTURE` has those that are about the
shape of arrays. To teach the page another primitive, add it here, and what it computes to
``assets/functions.glsl`` if GLSL has no function of that name or only a rough one.
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
    Value,
    flat_index,
    kept,
    with_shape,
)

Handler = Callable[[Code, Sequence[Value], dict[str, Any], tuple[int, ...], str], Value]


class TranslationError(ValueError):
    """A model that GLSL cannot evaluate, with what stands in the way."""


# Functions whose names begin with f_ are ours: GLSL leaves the precision of its own to the
# hardware, and has no counterpart of some.
TEMPLATES: dict[str, str] = {
    "add": "{0} + {1}",
    "sub": "{0} - {1}",
    "mul": "{0} * {1}",
    "div": "{0} / {1}",
    "neg": "-{0}",
    "abs": "abs({0})",
    "sign": "sign({0})",
    "max": "max({0}, {1})",
    "min": "min({0}, {1})",
    "clamp": "clamp({1}, {0}, {2})",
    "floor": "floor({0})",
    "ceil": "ceil({0})",
    "round": "roundEven({0})",
    "rem": "f_rem({0}, {1})",
    "sqrt": "sqrt({0})",
    "rsqrt": "(1.0 / sqrt({0}))",
    "cbrt": "f_cbrt({0})",
    "square": "{0} * {0}",
    "exp": "f_exp({0})",
    "exp2": "f_exp2({0})",
    "expm1": "f_expm1({0})",
    "log": "f_log({0})",
    "log1p": "f_log1p({0})",
    "pow": "f_pow({0}, float({1}))",
    "logistic": "(1.0 / (1.0 + f_exp(-{0})))",
    "sin": "f_sin({0})",
    "cos": "f_cos({0})",
    "tan": "(f_sin({0}) / f_cos({0}))",
    "asin": "f_atan2({0}, sqrt((1.0 - {0}) * (1.0 + {0})))",
    "acos": "f_atan2(sqrt((1.0 - {0}) * (1.0 + {0})), {0})",
    "atan": "f_atan2({0}, 1.0)",
    "atan2": "f_atan2({0}, {1})",
    "sinh": "f_sinh({0})",
    "cosh": "f_cosh({0})",
    "tanh": "f_tanh({0})",
    "asinh": "f_asinh({0})",
    "erf": "f_erf({0})",
    "erfc": "f_erfc({0})",
    "is_finite": "!(isinf({0}) || isnan({0}))",
    "select_n": "({0} ? {2} : {1})",
    "stop_gradient": "{0}",
    "copy": "{0}",
    "eq": "{0} == {1}",
    "ne": "{0} != {1}",
    "lt": "{0} < {1}",
    "le": "{0} <= {1}",
    "gt": "{0} > {1}",
    "ge": "{0} >= {1}",
}
_LOGIC = {"and": ("&&", "&"), "or": ("||", "|"), "xor": ("^^", "^"), "not": ("!", "~")}
_KINDS = {"f": "float", "b": "bool", "i": "int", "u": "int"}


def kind_of(dtype: Any) -> str:
    """The type in GLSL of an array's numbers. Raises `TranslationError`."""
    kind = _KINDS.get(np.dtype(dtype).kind)
    if kind is None:
        raise TranslationError(f"numbers of type {dtype}; expected real ones")
    return kind


def translate(
    code: Code,
    name: str,
    operands: Sequence[Value],
    params: dict[str, Any],
    shape: tuple[int, ...],
    kind: str,
) -> Value:
    """What a primitive makes of its operands. Raises `TranslationError`."""
    if name in STRUCTURE:
        return STRUCTURE[name](code, operands, params, shape, kind)
    if name == "convert_element_type":
        if operands[0].kind == kind:
            return operands[0]
        if isinstance(operands[0], Scalar) and operands[0].literal:
            text = f"{kind}({operands[0].name})"
            return Scalar(text, kind, True, literal=True)
    text = _text(name, operands, params, kind)
    known = all(o.known for o in operands)
    if not shape:
        block = code.block(known)
        parts = [code.scalar(block, o) for o in operands if isinstance(o, Scalar)]
        return Scalar(code.emit(block, kind, text.format(*parts)), kind, known)
    out = Array(shape, kind, known, lambda block, index: "")

    def element(block: Block, index: Index) -> str:
        found = block.found((out, index))
        if found is None:
            # Operands of other shapes are numbers.
            parts = [code.at(block, o, index) for o in operands]
            found = code.emit(block, kind, text.format(*parts))
            block.scopes[-1][out, index] = found
        return found

    out.element = element
    return out


def _text(name: str, operands: Sequence[Value], params: dict[str, Any], kind: str) -> str:
    if name == "integer_pow":
        return _integer_power(int(params["y"]))
    if name == "convert_element_type":
        return f"{kind}({{0}})"
    if name in _LOGIC:
        sign = _LOGIC[name][operands[0].kind != "bool"]
        return f"{sign}{{0}}" if name == "not" else f"{{0}} {sign} {{1}}"
    if name not in TEMPLATES:
        raise TranslationError(
            f"the operation {name!r}, which the page does not know; expected one of "
            f"{', '.join(sorted([*TEMPLATES, *STRUCTURE]))}"
        )
    return TEMPLATES[name]


def _integer_power(power: int) -> str:
    """By repeated squaring, as JAX does."""
    if power == 0:
        return "1.0"
    factors = {1: "{0}"}

    def of(n: int) -> str:
        if n not in factors:
            half = of(n // 2)
            whole = f"({half} * {half})"
            factors[n] = f"({whole} * {{0}})" if n % 2 else whole
        return factors[n]

    return of(power) if power > 0 else f"1.0 / {of(-power)}"


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
