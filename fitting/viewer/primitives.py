"""JAX's primitives in GLSL: a function for each, by name.

Of most a template of their operands will do; those that are about the shape of arrays
are in `fitting.viewer.structure`. To teach the page another primitive, add it here, and
what it computes to ``assets/functions.glsl`` if GLSL has no function of that name or only a
rough one.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from fitting.viewer.blocks import Array, Block, Code, Index, Scalar, TranslationError, Value
from fitting.viewer.structure import STRUCTURE

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
