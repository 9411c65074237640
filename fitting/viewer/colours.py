"""From the channels of a fit to the colours of a screen."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from data_formats import Channel
from fitting.scene.description import SceneError
from fitting.scene.difference import to_display
from fitting.scene.load import load_scene
from fitting.scene.photometry import photometry

_LIGHT = "studio"
# Of linear sRGB (IEC 61966-2-1).
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


class Display(NamedTuple):
    """How channels are shown.

    ``rgb (c, 3)``: linear sRGB is ``cos_i f @ rgb`` where the sample is lit from one
    direction, with 1 for the perfect diffuser that faces the light. ``luminance (c,)`` sums
    up to one number, with weights of sum 1. ``coloured``: whether the channels make a
    colour, and not luminance only.
    """

    rgb: np.ndarray
    luminance: np.ndarray
    coloured: bool


def display(channels: Sequence[Channel]) -> Display:
    """For light of the spectrum D50, to which the eye is adapted.

    What the channels mean is as in `fitting.scene.photometry.tristimulus`; if none of them
    is visible, they all count alike.
    """
    try:
        light = photometry(load_scene(_LIGHT), channels)
    except SceneError:
        grey = np.full((len(channels), 3), np.pi / len(channels))
        return Display(grey, grey[:, 1] / np.pi, False)
    xyz = np.pi * light.white[:, None] * light.tristimulus
    rgb = to_display(xyz, light.display_white)
    luminance = rgb @ _LUMINANCE
    coloured = bool(np.linalg.matrix_rank(rgb, tol=1e-9) > 1)
    return Display(rgb, luminance / luminance.sum(), coloured)
