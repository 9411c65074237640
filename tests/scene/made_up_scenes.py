"""Scenes and channels that the tests of lights share."""

from __future__ import annotations

import msgspec
import numpy as np

from data_formats import Channel
from fitting.scene import Scene
from fitting.scene.emitters import Emitter, emitter_irradiance, emitters

GREY = (Channel("luminance"),)
RGB = tuple(Channel(c) for c in "RGB")
XYZ = tuple(Channel(c) for c in "XYZ")
NM10 = tuple(Channel.at(w) for w in range(400, 701, 10))
UP = np.array([0.0, 0.0, 1.0])


def made(*lights: dict, **scene) -> Scene:
    plain = {"seen": {"kind": "flat"}, "tolerance": {"albedo": {}}, **scene}
    return msgspec.convert({"lights": list(lights), **plain}, Scene)


def only(light: dict, channels=GREY, **scene) -> Emitter:
    (emitter,) = emitters(made(light, **scene), channels)
    return emitter


def falls(emitter: Emitter, *normal: float) -> float:
    return float(emitter_irradiance(emitter, np.array([normal]))[0, 0])
