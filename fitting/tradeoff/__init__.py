"""The trade between speed and accuracy, measured: what ``brdf tradeoff`` tabulates."""

from fitting.tradeoff.evaluation_cost import EvaluationCost, evaluation_cost, operations

__all__ = ["EvaluationCost", "evaluation_cost", "operations"]
