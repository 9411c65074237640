"""A `Measurement` as the named columns and rows of a text table, in full precision."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from data_formats.columns import angle_of, channel_of
from data_formats.measurement import Channel, Measurement

_SAFE = re.compile(r"[A-Za-z0-9][\w.-]*", re.ASCII)


@dataclass(frozen=True)
class Labels:
    """Names of columns that are safe in a text table, and say what they should.

    **Arguments:**

    - `channels`: one for each channel: `400nm`, or the band's name.
    - `auxiliary`: one for each auxiliary column, by its name.
    """

    channels: list[str]
    auxiliary: dict[str, str]

    @staticmethod
    def of(measurement: Measurement) -> Labels:
        """The labels of a measurement; always the same for the same names."""
        taken: set[str] = set()
        channels = [_distinct(_channel_label(c), taken) for c in measurement.channels]
        auxiliary = {
            name: _distinct(_auxiliary_label(name), taken) for name in measurement.auxiliary
        }
        return Labels(channels, auxiliary)


def rows_of_text(
    measurement: Measurement, angles: Sequence[str], labels: Labels
) -> tuple[list[str], list[str]]:
    """Column names and comma-separated rows.

    Numbers are the shortest that read back as the same float64. Masked values that are
    known stay, with a column that masks them; the others are NaN.

    **Arguments:**

    - `measurement`: what to write.
    - `angles`: the names of the four columns of angles.
    - `labels`: those of the other columns.
    """
    m = measurement
    channels = labels.channels
    names = [*angles, *channels]
    blocks = [np.stack([m.theta_i, m.phi_i, m.theta_r, m.phi_r], axis=1), m.value]
    if (np.isfinite(m.value) & ~m.valid).any():
        _spread("valid", m.valid.astype(np.float64), channels, names, blocks)
    if m.sigma is not None:
        _spread("sigma", m.sigma, channels, names, blocks)
    for name, column in m.auxiliary.items():
        names.append(labels.auxiliary[name])
        blocks.append(column[:, None])
    rows = np.concatenate(blocks, axis=1).tolist()
    return names, [",".join(map(_shortest, row)) for row in rows]


def _shortest(number: float) -> str:
    return repr(number).removesuffix(".0")


def _spread(
    word: str,
    table: NDArray[np.float64],
    channels: Sequence[str],
    names: list[str],
    blocks: list[NDArray[np.float64]],
) -> None:
    """Add one column if all channels agree, else one per channel."""
    if (table == table[:, :1]).all():
        names.append(word)
        blocks.append(table[:, :1])
    else:
        names += [f"{word}_{channel}" for channel in channels]
        blocks.append(table)


def _channel_label(channel: Channel) -> str:
    if channel.wavelength_nm is not None:
        return repr(channel.wavelength_nm).removesuffix(".0") + "nm"
    # A band that readers know keeps its name; any other might pass for something else.
    known = channel_of(channel.name) if _SAFE.fullmatch(channel.name) else None
    return channel.name if known == channel else f"band_{_safe(channel.name)}"


def _auxiliary_label(name: str) -> str:
    means_something = (
        angle_of(name) or channel_of(name) or "sigma" in name or "valid" in name
    )
    plain = _SAFE.fullmatch(name) and not means_something
    return name if plain else f"column_{_safe(name)}"


def _safe(name: str) -> str:
    """A name of letters, digits and `_ . -` only, and not too long for a column."""
    return re.sub(r"[^A-Za-z0-9_.-]", "_", name)[:80]


def _distinct(name: str, taken: set[str]) -> str:
    distinct, k = name, 2
    while distinct in taken:
        distinct, k = f"{name}_{k}", k + 1
    taken.add(distinct)
    return distinct
