"""Room behind the rows, and the blocks in which they are summed."""

from __future__ import annotations

import jax
import numpy as np
import pytest

from fitting import padding

ROWS = (1, 128, 129, 1439, 4096, 4097, 10_804, 100_000, 999_999, 10_000_000)


@pytest.mark.parametrize(("device", "most"), [("cpu", 4096), ("gpu", 1 << 19)])
def test_blocks_are_all_rows_and_no_larger_than_is_good_for_the_device(
    monkeypatch, device, most
):
    monkeypatch.setattr(jax, "default_backend", lambda: device)
    for n in ROWS:
        size = padding.bucket(n)
        block = padding.rows_at_once(size)
        assert n <= size <= max(128, 2 * n)
        assert size % block == 0
        assert block <= most
    # A million rows: two blocks on a GPU, which is idle between them.
    million = padding.bucket(1_000_000)
    assert million // padding.rows_at_once(million) == (2 if device == "gpu" else 256)


def test_what_is_padded_lies_where_jax_works_on_it():
    a = padding.padded(np.arange(6.0).reshape(2, 3), 8, fill=1.0)
    assert a.ctypes.data % 64 == 0
    np.testing.assert_array_equal(a[:, :3], np.arange(6.0).reshape(2, 3))
    assert np.all(a[:, 3:] == 1.0)
