"""``brdf view``: fits in a web page, to look at and to play with."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from fitting.cli.failures import UsageError
from fitting.cli.flags import Data, DataFormat, Flags, Reader


def view(
    *results: Annotated[
        Path,
        Parameter(help="Results of `brdf fit`, shown side by side.", show_default=False),
    ],
    data: Data = None,
    output: Annotated[
        Path | None,
        Parameter(
            name=("--output", "-o"),
            help="The page, or a folder for it; without: NAME.view.html in the current "
            "folder.",
        ),
    ] = None,
    open: Annotated[
        bool,
        Parameter(negative="", show_default=False, help="Open the page in a browser."),
    ] = False,
    data_format: DataFormat = None,
    reader: Reader = None,
    flags: Flags | None = None,
) -> int:
    """A web page of one file with lobe, lit sphere, slices, albedo, and sliders."""
    if not results:
        raise UsageError("view: expected a result of `brdf fit`, NAME.fit.json")
    from fitting.cli import assignments, jax_setup, view_run
    from fitting.result import load_result

    asked = view_run.Asked(
        results, tuple(data or ()), output, data_format,
        assignments.of_lines("reader", reader or []),
    )  # fmt: skip
    target = view_run.target(asked)
    fitted = [load_result(path) for path in results]
    jax_setup.set_up()
    view_run.run(fitted, asked, target, flags or Flags())
    print(target)
    if open:
        import webbrowser

        webbrowser.open(target.resolve().as_uri())
    return 0
