"""A batch costs, file by file, hardly more than to read the file and to fit it.

    python -m pytest tests/benchmarks/test_batch.py -m slow -n 0

In seconds of the processors, which other load disturbs less than the clock.
"""

from __future__ import annotations

from pathlib import Path

import batch_time
import pytest

pytestmark = pytest.mark.slow

FEW, MANY = 2, 14


def test_more_files_cost_their_reading_and_fitting(
    tmp_path: Path, pytestconfig: pytest.Config, line
):
    # Kept, since compiling takes most of a minute.
    cache = pytestconfig.rootpath / ".pytest_cache" / "compiled_for_batches"
    paths = batch_time.write_paints(tmp_path, MANY)
    batch_time.batch(paths, tmp_path / "compiled", cache)
    few = batch_time.batch(paths[:FEW], tmp_path / "few", cache)
    many = batch_time.batch(paths, tmp_path / "many", cache)
    resumed = batch_time.batch(paths, tmp_path / "many", cache, "--resume")
    alone = batch_time.inside(paths, cache)
    each = (many.cpu - few.cpu) / (MANY - FEW)
    bare = alone["reading a file"].cpu + alone["one fit more"].cpu
    line(f"brdf batch, {batch_time.ROWS} rows x 3, {batch_time.MODEL}, seconds of CPU")
    line(f"  {f'{MANY} files':44} {many.cpu:9.3f}")
    line(f"  {f'{FEW} files, one per process':44} {few.cpu:9.3f}")
    line(f"  {'each file more':44} {each:9.3f}")
    line(f"  {'reading and fitting one in a process':44} {bare:9.3f}")
    line(f"  {'resumed when all is done':44} {resumed.cpu:9.3f}")
    assert each < 1.6 * bare
    assert resumed.cpu < 0.25 * many.cpu
