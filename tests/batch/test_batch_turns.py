"""One compiles, the others wait for it, and nobody waits for the dead."""

from __future__ import annotations

from pathlib import Path

import pytest
from batch_jobs import Compile

from fitting.batch import Processes
from fitting.batch.turns import first_of


@pytest.mark.parametrize("kills_once", [False, True])
def test_the_others_wait_for_the_first(tmp_path: Path, kills_once: bool):
    items = {f"{k}": k for k in range(6)}
    answers = Processes(3).run(Compile(tmp_path, kills_once), items, retries=1)
    times = sorted(done.value for done in answers)
    assert len(times) == 6
    first, others = times[0], times[1:]
    assert all(begin >= first[1] for begin, _ in others)
    # Then together: two begin before one of them ends.
    assert others[1][0] < others[0][1]


def test_without_a_cache_nobody_waits():
    with first_of("x", None), first_of("x", None):
        pass


def test_a_failure_leaves_it_to_the_next(tmp_path: Path):
    with pytest.raises(ValueError, match="no"), first_of("x", tmp_path):
        raise ValueError("no")
    assert not list(tmp_path.glob("*.compiled"))
    with first_of("x", tmp_path):
        pass
    assert len(list(tmp_path.glob("*.compiled"))) == 1
