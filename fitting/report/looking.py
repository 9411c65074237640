"""The surface to be turned and lit in the page: the viewer of `fitting.viewer`."""

from __future__ import annotations

from collections.abc import Sequence

from fitting.report.blocks import Block, Embedded, Words
from fitting.report.reported import Reported
from fitting.viewer import TranslationError, fragment


def blocks(every: Sequence[Reported]) -> list[Block]:
    """All results side by side, or in words why not."""
    try:
        html = fragment(
            [one.result for one in every],
            [one.measurement for one in every],
            [one.file or one.name for one in every],
        )
    except TranslationError as error:
        return [Words(f"There is no view of it: {error}.")]
    return [Embedded(html)]
