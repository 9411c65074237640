"""The lights of a scene as a renderer sees them: where from, how much, which channels."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from data_formats.measurement import Channel
from fitting.scene.description import Scene

Pattern = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]


class Emitter(NamedTuple):
    """One light: ``k`` patterns over directions with a spectrum each, in ``c`` channels.

    The radiance of channel ``j`` from a direction is ``sum_k pattern_k spectrum[k, j]``;
    if ``half_angle`` is 0 that is the irradiance at normal incidence instead. World
    coordinates as in `fitting.scene.description`.

    - ``axis (3,)``: unit vector towards the light.
    - ``half_angle``, rad: no light comes from farther off the axis; 0 a direction, pi / 2
      a sky, pi everywhere.
    - ``pattern``: x, y, z ``(n,)`` of unit vectors towards the light to ``(k, n)``.
    - ``spectrum (k, c)``.
    - ``finest``, rad: the smallest detail of the pattern.

    In the ``histogram`` geometry the axis is z, and every row puts it at its incidence.
    """

    name: str
    axis: np.ndarray
    half_angle: float
    pattern: Pattern
    spectrum: np.ndarray
    finest: float


def emitters(scene: Scene, channels: Sequence[Channel]) -> tuple[Emitter, ...]:
    """The lights of a scene at the channels of a measurement; the ground, if any, is last.

    Raises `SceneError` if a file of the scene cannot be used, or no light has any of the
    channels that count.
    """
    raise NotImplementedError
