"""What a scene's light amounts to: white, exposure, and colours from radiances."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from data_formats.measurement import Channel
from fitting.scene.description import Scene


def white(scene: Scene, channels: Sequence[Channel]) -> np.ndarray:
    """Radiance ``(c,)`` of a perfect diffuser, f = 1 / pi, that faces the light.

    That is its irradiance / pi: of ``flat`` lying horizontally, of ``sphere`` where its
    luminance is largest, of ``histogram`` at normal incidence.
    """
    raise NotImplementedError


def counts(scene: Scene, channels: Sequence[Channel]) -> np.ndarray:
    """Whether each channel ``(c,)`` counts: named bands, and wavelengths in the range."""
    raise NotImplementedError


def tristimulus(scene: Scene, channels: Sequence[Channel]) -> np.ndarray:
    """``XYZ = radiances @ matrix (c, 3)`` as displayed: Y = 100 is the display's white.

    The exposure is included: `white` times it has Y = 100 * exposure (auto is 1).
    """
    raise NotImplementedError


def display_white(scene: Scene, channels: Sequence[Channel]) -> np.ndarray:
    """XYZ ``(3,)`` of the display's white, Y = 100: white for L*a*b*, and where to clip.

    Its chromaticity is that of a perfect diffuser in the scene's light.
    """
    raise NotImplementedError
