"""The trade between speed and accuracy, measured: what ``brdf tradeoff`` tabulates.

    from fitting.tradeoff.study import Plan, ladder, study
    *_, table = study(measurement, Plan(ladder(measurement)), say=lambda what, units: None)
    table.save("paint.tradeoff.json")

`evaluation_cost` measures one model, `operations` only counts.
"""

from fitting.tradeoff.evaluation_cost import EvaluationCost, evaluation_cost, operations

__all__ = ["EvaluationCost", "evaluation_cost", "operations"]
