"""A model in GLSL, translated from the program that JAX traces of it.

There is one definition of a lobe, the one that is fitted; the page evaluates what follows
from it. A number that only depends on parameters is computed in ``prepare``, once per
change of a parameter, and not for every pixel: see `fitting.viewer.blocks`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.extend.core import ClosedJaxpr, Literal

from fitting.geometry import from_components
from fitting.model import Model
from fitting.viewer.blocks import Block, Code, Scalar, TranslationError, Value
from fitting.viewer.primitives import kind_of, translate

_NESTED = ("jaxpr", "call_jaxpr", "fun_jaxpr")
_DIRECTIONS = ("wi.x", "wi.y", "wi.z", "wo.x", "wo.y", "wo.z")


@dataclass(frozen=True)
class Shader:
    """A model as GLSL ES 3.00.

    - ``prepare``: ``void prepare(float p[P], out float known[K])``; the last ``basis``
      of the ``K`` numbers are the amplitudes.
    - ``evaluate``: ``void basis(vec3 wi, vec3 wo, out float b[J])``, 1/sr, which calls
      ``float known(int)``.
    - ``parameters``: the names in the order of ``p``.
    """

    constants: str
    prepare: str
    evaluate: str
    parameters: tuple[str, ...]
    known: int
    basis: int


def shader(model: Model) -> Shader:
    """Translate a model; in float32, which is what graphics hardware has.

    Raises `TranslationError` if it does something that has no translation.
    """
    names = tuple(model.parameters())
    coefficients = {n for n, p in model.parameters().items() if p.coefficient}

    def function(values: Sequence[Any], directions: Sequence[Any]) -> tuple:
        by_name = dict(zip(names, values, strict=True))
        shape = {n: v for n, v in by_name.items() if n not in coefficients}
        linear = {n: v for n, v in by_name.items() if n in coefficients}
        geometry = from_components(*directions)
        return model.amplitudes(shape, linear), model.basis(shape, geometry)

    with jax.enable_x64(False):
        some = jnp.float32(0.5)
        traced, tree = jax.make_jaxpr(function, return_shape=True)(
            [some] * len(names), [some] * len(_DIRECTIONS)
        )
    try:
        return _translated(names, traced, len(tree[1]))
    except TranslationError as error:
        raise TranslationError(
            f"the model {model.expression!r} cannot be evaluated in a web page: it has "
            f"{error}"
        ) from error


def _translated(names: tuple[str, ...], traced: ClosedJaxpr, count: int) -> Shader:
    code = Code()
    inputs: list[Value] = [
        Scalar(code.emit(code.prepare, "float", f"p[{k}]"), "float", True)
        for k in range(len(names))
    ]
    inputs += [Scalar(name, "float", False) for name in _DIRECTIONS]
    outputs = _run(code, traced.jaxpr, traced.consts, inputs)
    return _assembled(code, names, outputs[:count], outputs[count:])


def _run(
    code: Code, jaxpr: Any, consts: Sequence[Any], inputs: Sequence[Value]
) -> list[Value]:
    """Write a traced program's operations; calls of others are written out in place."""
    values: dict[Any, Value] = dict(zip(jaxpr.invars, inputs, strict=True))
    for variable, constant in zip(jaxpr.constvars, consts, strict=True):
        values[variable] = _constant(code, constant)

    def read(atom: Any) -> Value:
        return _constant(code, atom.val) if isinstance(atom, Literal) else values[atom]

    for equation in jaxpr.eqns:
        operands = [read(a) for a in equation.invars]
        inner = next((equation.params[k] for k in _NESTED if k in equation.params), None)
        if inner is not None:
            results = _call(code, inner, operands)
        else:
            (out,) = equation.outvars
            results = [
                translate(
                    code, equation.primitive.name, operands, equation.params,
                    tuple(out.aval.shape), kind_of(out.aval.dtype),
                )
            ]  # fmt: skip
        values.update(zip(equation.outvars, results, strict=True))
    return [read(a) for a in jaxpr.outvars]


def _call(code: Code, inner: Any, operands: Sequence[Value]) -> list[Value]:
    if isinstance(inner, ClosedJaxpr):
        return _run(code, inner.jaxpr, inner.consts, operands)
    return _run(code, inner, (), operands)


def _constant(code: Code, value: Any) -> Value:
    array = np.asarray(value)
    return code.constant(array, kind_of(array.dtype))


def _assembled(
    code: Code, names: tuple[str, ...], amplitudes: list[Value], basis: list[Value]
) -> Shader:
    ends = [f"  b[{k}] = {_number(code, code.evaluate, v)};" for k, v in enumerate(basis)]
    factors = [
        f"  known[{code.slots + k}] = {_number(code, code.prepare, v)};"
        for k, v in enumerate(amplitudes)
    ]
    known = code.slots + len(factors)
    return Shader(
        constants="\n".join(code.constants),
        prepare="\n".join(
            [
                f"void prepare(float p[{max(len(names), 1)}], out float known[{known}]) {{",
                *code.prepare.lines,
                *code.handed,
                *factors,
                "}",
            ]
        ),
        evaluate="\n".join(
            [
                f"void basis(vec3 wi, vec3 wo, out float b[{len(basis)}]) {{",
                *code.loads,
                *code.evaluate.lines,
                *ends,
                "}",
            ]
        ),
        parameters=names,
        known=known,
        basis=len(basis),
    )


def _number(code: Code, block: Block, value: Value) -> str:
    if not isinstance(value, Scalar):
        raise TranslationError(f"an array {value.shape} where a number is expected")
    return code.scalar(block, value)
