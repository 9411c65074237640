"""What a report is about."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from data_formats import Measurement
from fitting.result import FitResult
from fitting.verdict import Verdict, judge


@dataclass(frozen=True)
class Reported:
    """A result, the data that it was fitted to, and the name of its file.

    ``why`` says why there are no data, or what is to be known about them.
    """

    result: FitResult
    measurement: Measurement | None = None
    why: str = ""
    file: str = ""

    @property
    def verdict(self) -> Verdict:
        """In words; by the result alone where the data were only found again."""
        data = self.measurement
        same = data is not None and data.provenance.sha256 == self.result.data.sha256
        if same and self.result.typical_deviation is not None:
            return judge(self.result, None)
        return judge(self.result, data)

    @property
    def name(self) -> str:
        """Of the sample, or of the file that was fitted."""
        data = self.result.data
        files = " + ".join(Path(p).name for p in data.path.split(" + ") if p)
        return data.sample or files or "Data without a file"
