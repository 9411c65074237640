"""Many small convex quadratic programs at once, one per channel.

The coefficients of a channel (a handful) minimise a quadratic under bounds and, on
request, the energy polytope. All channels run together; and what is found beside the
minimiser is the inverse Hessian restricted to the free directions, which is what the
elimination of the coefficients needs next.

`within` knows bounds only, and needs one or two linear systems where `solve`, for any
linear constraints, needs twenty.
"""

from fitting.qp.interior_points import solve
from fitting.qp.linear import inverse, product
from fitting.qp.pivoting import within

__all__ = ("inverse", "product", "solve", "within")
