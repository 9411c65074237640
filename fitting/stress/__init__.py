"""The proof that lobes can be trusted, to be run on any of them.

from fitting.stress import check_lobe
assert check_lobe(MyLobe()).passed
"""

from fitting.stress.finding import Finding
from fitting.stress.precision import Precision
from fitting.stress.report import Report, check_lobe, examine
from fitting.stress.variants import Variant

__all__ = ["Finding", "Precision", "Report", "Variant", "check_lobe", "examine"]
