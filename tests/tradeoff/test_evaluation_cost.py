"""The compiler's count against counts by hand."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
import pytest

from fitting import Model, ModelError
from fitting.tradeoff import evaluation_cost, operations
from fitting.tradeoff.evaluation_cost import Kernel, batch_rows, count_of


def test_count_of_a_kernel_is_that_by_hand():
    """``exp(x) 2 + s`` with ``s`` the sum of 64 sines, made once per call."""
    table = np.linspace(0.0, 1.0, 64)

    def function(x, t):
        return 2.0 * jnp.exp(x) + jnp.sum(jnp.sin(t))

    x = np.linspace(0.0, 1.0, 1000)
    many = Kernel(function, x, table, precision="float32")
    one = Kernel(function, x[:1], table, precision="float32")
    found = count_of(many, x.size, one)
    assert (found.flops, found.transcendentals) == (2.0, 1.0)
    assert found.transcendentals_once == 64.0
    # 63 or 64 additions, by how the sum begins.
    assert found.flops_once == pytest.approx(64.0, abs=1.0)
    assert found.operations == 2.0 + 30.0


@pytest.mark.parametrize(("channels", "flops"), [(1, 8.0), (3, 10.0), (31, 38.0)])
def test_lambert_by_hand(channels, flops):
    """Three comparisons, a sum and two ands tell what is lit; a choice; a product each."""
    assert operations("lambert", channels) == 7.0 + channels == flops


def test_more_lobes_and_channels_are_more_operations():
    one, two = operations("lambert + ggx", 3), operations("lambert + 2*ggx", 3)
    assert operations("lambert", 3) < one < two < 2 * one
    assert one < operations("lambert + ggx", 31)
    # Each channel with a width of its own repeats the lobe, and not the base.
    assert operations("lambert + ggx", 3, per_channel_shape=True) > 2 * one


def test_cost_has_both_precisions_and_the_same_count():
    model = Model("lambert + ggx")
    cost = evaluation_cost(model.expression, 3, model.defaults(), repeats=3)
    assert cost.operations == operations("ggx + lambert", 3) == cost.count.operations
    for name in ("float32", "float64"):
        times = cost.of(name)
        assert times is not None
        assert times.batched_ns.repeats == 3
        assert 0 < times.batched_ns.low <= times.batched_ns.median <= times.batched_ns.high
        # A call takes microseconds before it computes anything.
        assert times.single_ns.median > 20 * times.batched_ns.median
    assert (
        evaluation_cost("lambert", 1, {"lambert.albedo": 0.5}, precisions=()).of("float32")
        is None
    )


def test_what_makes_no_sense():
    with pytest.raises(ModelError):
        operations("lamber", 1)
    with pytest.raises(ModelError, match="missing"):
        evaluation_cost("ggx", 1, {"ggx.alpha": 0.1})


def test_batches_hold_about_as_many_values():
    assert batch_rows(1) == 1 << 16
    assert batch_rows(31) == 1 << 12
