"""What the data leave open, in sentences."""

from __future__ import annotations

import itertools

import numpy as np

from fitting import sampling
from fitting.quantities import percent
from fitting.reduced import Problem
from fitting.result import ParameterResult
from fitting.solve import Solution

_STRONG = 0.95
_ALONG = 0.5
_MANY_ZEROS = 0.02
_EXACT = 1e-7
_NOTICEABLE = 1e-3


def of_data(
    problems: list[Problem],
    ends: list[Solution],
    values: list[dict[str, np.ndarray]],
    counts: list[np.ndarray],
    penalties: list[float],
    channels: list[str],
) -> list[str]:
    """Sentences on what the data are, and what they can tell with this model.

    One problem with all ``channels``, or one per channel; ``counts`` are the numbers of
    valid values of every channel, ``penalties`` the share of the penalties in the costs.
    """
    out = _missing_values(problems, counts, channels)
    out += _few_rows(problems)
    out += _cut_off(problems)
    out += _exact(problems, ends)
    out += _reciprocity(problems, penalties)
    for i, (problem, own) in enumerate(zip(problems, values, strict=True)):
        where = f" (at {channels[i]})" if len(problems) > 1 else ""
        out += [sentence + where for sentence in sampling.sentences(problem, own)]
    return out


def _missing_values(
    problems: list[Problem], counts: list[np.ndarray], channels: list[str]
) -> list[str]:
    out = [
        f"{channels[c]} has no valid value: its parameters mean nothing"
        for c in np.flatnonzero(np.concatenate(counts) == 0)
    ]
    for problem, count in zip(problems, counts, strict=True):
        n = problem.unknowns.n_coefficients * count.size + problem.unknowns.n_shape
        if 0 < count.sum() <= n:
            out.append(
                f"{int(count.sum())} values for {n} free parameters: nothing is "
                "left over to judge the errors by"
            )
    return out


def _few_rows(problems: list[Problem]) -> list[str]:
    """Fewer directions than a channel has parameters, though channels may make up for it.

    Error bars take rows for independent, and of so few there is no telling.
    """
    out: list[str] = []
    for problem in problems:
        rows = int(np.sum(np.any(np.asarray(problem.weight) > 0, axis=0)))
        names = [*problem.unknowns.free_shape, *problem.unknowns.free_coefficients]
        if problem.unknowns.n_shape and 0 < rows <= len(names):
            sentence = (
                f"{rows} rows for the {len(names)} parameters of a channel: "
                f"{', '.join(names)} may be far off, and their uncertainties too small"
            )
            out += [sentence] if sentence not in out else []
    return out


def _cut_off(problems: list[Problem]) -> list[str]:
    """Zeros where noise would have been negative are no measurements of zero."""
    zeros = valid = negative = positive = 0
    for problem in problems:
        value = np.asarray(problem.linear_target)
        used = np.broadcast_to(np.asarray(problem.weight) > 0, value.shape)
        zeros += int(np.sum(used & (value == 0)))
        valid += int(np.sum(used))
        negative += int(np.sum(used & (value < 0)))
        positive += int(np.sum(used & (value > 0)))
    if negative or not positive or zeros <= _MANY_ZEROS * valid:
        return []
    return [
        f"{zeros} of {valid} values are exactly 0 and none is negative: if noise was cut "
        "off there, the fit is too bright where the data are dark, by more than its "
        "standard uncertainties say"
    ]


def _exact(problems: list[Problem], ends: list[Solution]) -> list[str]:
    cost = sum(float(e.cost) for e in ends)
    scale = sum(float(p.scale) for p in problems)
    free = any(p.unknowns.n_shape + p.unknowns.n_coefficients for p in problems)
    if not free or not 0.0 <= cost < _EXACT**2 * scale:
        return []
    return [
        f"the model agrees with the data to {max((cost / scale) ** 0.5, 1e-16):.1g} of "
        "their size, closer than anything is measured: the standard uncertainties are "
        "those of rounding, and too small where the data hardly show a lobe"
    ]


def _reciprocity(problems: list[Problem], penalties: list[float]) -> list[str]:
    if all(p.model.reciprocal for p in problems):
        return []
    out: list[str] = []
    if all(lobe.RECIPROCAL for p in problems for lobe in p.model.lobes):
        out.append(
            "the lobes that transmit disagree on the media: some lie between different "
            "indices, others not (lambert_transmission has the option 'media') or with an "
            "index of their own (tie it), so that the sum is not reciprocal"
        )
    if max(penalties) >= _NOTICEABLE:
        out.append(
            f"{percent(max(penalties))} of the cost is the penalty on what changes when "
            "source and detector are exchanged, which pulls the fit away from the data; "
            "the uncertainties are those of the data alone"
        )
    return out


def of_parameters(
    table: list[ParameterResult], names: list[str], blocks: np.ndarray, channels: list[str]
) -> list[str]:
    """Sentences on which parameters trade off, are at a bound, or are not determined.

    ``blocks`` are the correlation matrices of the parameters ``names``, per channel.
    """
    out: list[str] = []
    for (i, a), (j, b) in itertools.combinations(enumerate(names), 2):
        pair = blocks[:, i, j]
        strong = np.flatnonzero(np.nan_to_num(np.abs(pair)) > _STRONG)
        if not strong.size:
            continue
        worst = strong[np.argmax(np.abs(pair[strong]))]
        known = "sum" if pair[worst] < 0 else "difference"
        where = f"in {strong.size} of {len(channels)} channels" if len(channels) > 1 else ""
        out.append(
            f"{a} and {b} trade off {where}".rstrip()
            + f" (correlation {pair[worst]:+.3f} at {channels[worst]}): "
            f"their scaled {known} is known, not their split"
        )
    for p in table:
        if p.fixed or p.tied_to:
            continue
        pairs = list(zip(p.value, p.standard_uncertainty, strict=True))
        loose = sum(s is not None and s > abs(v) for v, s in pairs)
        bound = sum(p.at_bound)
        unknown = sum(s is None for s in p.standard_uncertainty) - bound
        of = f" in {{}} of {len(pairs)} channels" if len(pairs) > 1 else ""
        if bound:
            out.append(f"{p.name} is at a bound{of.format(bound)}")
        if unknown > 0:
            out.append(
                f"{p.name} has no uncertainty{of.format(unknown)}: the data do not "
                "determine it at all"
            )
        if loose:
            out.append(
                f"{p.name} is not determined{of.format(loose)}: its standard uncertainty "
                "exceeds its value" + _company(p.name, names, blocks)
            )
    return out


def _company(name: str, names: list[str], blocks: np.ndarray) -> str:
    """Parameters whose errors, linear as they are, reach no farther than those of one
    that is not determined."""
    row = np.max(np.abs(np.nan_to_num(blocks[:, names.index(name)])), axis=0)
    others = [n for n, r in zip(names, row, strict=True) if r > _ALONG and n != name]
    if not others:
        return ""
    return f", and those of {', '.join(others)}, which go with it, may be too small"
