"""A fit takes hardly longer than importing JAX and optimistix, once it is compiled.

    python -m pytest tests/benchmarks/test_first_answer.py -m slow -n 0

Whole processes, in seconds of the processors, which other load disturbs less than the
clock.
On a quiet machine with two cores, by the clock: 1.5 times for one model, 4.2 times the very
first time (`first_answer.py` prints the table).
"""

from __future__ import annotations

import first_answer
import pytest

pytestmark = pytest.mark.slow


def test_the_first_answer(line):
    found = first_answer.measured(models=("lambert + ggx",))
    line("brdf fit -m 'lambert + ggx' --no-cv, the bundled sample")
    for name, seconds in found.items():
        line(f"  {name:44} {seconds.wall:9.2f} s {seconds.cpu:9.2f} s CPU")
    imports = found["imports"].cpu
    assert found["later"].cpu < 2.0 * imports
    assert found["first"].cpu < 8.0 * imports
