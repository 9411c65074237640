"""What is known of every channel and not fitted: wavelengths, indices of materials."""

from __future__ import annotations

import dataclasses

import numpy as np

from data_formats import Measurement
from fitting.expression import ModelError
from fitting.model import Model
from fitting.options import FitOptions, Value
from fitting.refractive_index import TRANSPARENT, Index, refractive_index


def with_given(measurement: Measurement, model: Model, options: FitOptions) -> FitOptions:
    """The options, with all that is known of the channels among what is fixed.

    Raises `ModelError` where a material is asked for and the channels have no wavelengths,
    or where the model has no place for it.
    """
    declared = model.parameters()
    known = measurement.wavelengths
    fixed: dict[str, Value] = {}
    sources: dict[str, str] = {}
    if known is not None:
        for name, parameter in declared.items():
            if parameter.given and name.endswith(".wavelength"):
                fixed[name] = np.asarray(known, dtype=np.float64)
    for label, material in options.material.items():
        if known is None:
            raise ModelError(
                f"material of {label}: the channels have no wavelengths; fix {label}.eta "
                "(and .k) at one value per channel instead"
            )
        index = refractive_index(material, np.asarray(known))
        fixed |= _fixed(label, index, set(declared))
        sources[label] = index.source
    return dataclasses.replace(options, fix={**fixed, **options.fix}, material=sources)


def _fixed(label: str, index: Index, declared: set[str]) -> dict[str, Value]:
    names = f"{label}.eta", f"{label}.k"
    if names[0] not in declared:
        have = sorted(n.rpartition(".")[0] for n in declared if n.endswith(".eta"))
        raise ModelError(
            f"material of {label!r}: the model has no {names[0]}; "
            + (f"lobes with an index: {', '.join(have)}" if have else
               "write for instance 'ggx(conductor)' or 'ggx(dielectric)'")
        )  # fmt: skip
    if names[1] in declared and not index.k_known:
        raise ModelError(
            f"material of {label}: {index.source} holds no k at these wavelengths, which "
            "the option 'conductor' needs; name another page, or give a table"
        )
    if names[1] in declared:
        return {names[0]: index.eta, names[1]: index.k}
    if np.any(index.k > TRANSPARENT):
        raise ModelError(
            f"material of {label}: {index.source} absorbs (k up to {index.k.max():.3g}), "
            "but the lobe has no k: give it the option 'conductor'"
        )
    return {names[0]: index.eta}
