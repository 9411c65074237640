"""What lobes promise with every pair of options, as users compile it, at many points."""

from __future__ import annotations

import jax
import pytest
from cases import COMBINED, VARIANTS, each

from fitting.stress import Variant, report
from fitting.stress.exercise import Exercise


@pytest.mark.full
@each(VARIANTS + COMBINED)
def test_contracts(variant: Variant):
    exercises = {p: Exercise(variant, p) for p in report.PRECISIONS}
    with jax.numpy_dtype_promotion("strict"):
        found = list(report.kept(exercises, 20_000))
    failed = [str(f) for f in found if not f.passed]
    assert not failed, "\n".join(failed)
