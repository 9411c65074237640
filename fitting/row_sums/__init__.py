"""Sums over the rows of a problem: what costs time, and nothing of which is kept.

Everything that a step needs of the rows are products of *features*, the basis functions
and their derivatives in the shape, with each other and with the residual. Three ways lead
to the same sums; `over_rows` takes the first that does:

- *inlined*: all sums are operands of one reduction, in which the compiler inlines the
  features. Nothing of the size of the data is ever written, and with sums reassociated
  (`FAST`) the loop runs in vector registers. For cheap features and a few channels.
- *held*: the features of a block of rows are written, and stay in the cache for reductions
  over a few channels after the other.
- *products*: the same with matrix products instead of reductions, for features that differ
  by channel, or that are many.
"""

from fitting.row_sums.features import dependents, n_basis
from fitting.row_sums.passes import by_function, linear_moments, of_functions, over_rows
from fitting.row_sums.reductions import FAST, add_up
from fitting.row_sums.rows import alike
from fitting.row_sums.sums import Sums

__all__ = (
    "FAST",
    "Sums",
    "add_up",
    "alike",
    "by_function",
    "dependents",
    "linear_moments",
    "n_basis",
    "of_functions",
    "over_rows",
)
