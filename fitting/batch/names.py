"""Names of results: one for every file, the same at every resumption."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

from fitting.batch.receipt import Receipt

_FOLDER_MARK = "__"


def names(
    sources: Sequence[Path], stem: Callable[[Path], str], there: Mapping[str, Receipt]
) -> list[str]:
    """A name for the result of every source, all different.

    The stem where it tells the sources apart; else the whole name, or with folders in
    front, ``a__paint``. ``there`` are receipts of earlier runs: their sources keep the
    names, and no other file gets them.
    """
    earlier = {receipt.source: name for name, receipt in there.items()}
    choices = {source: list(_choices(source, stem)) for source in sources}
    wished = Counter(c for some in choices.values() for c in dict.fromkeys(some))
    taken = set(there)
    out: list[str] = []
    for source in sources:
        name = earlier.get(str(source))
        if name is None or name in out:
            free = [c for c in choices[source] if c not in taken]
            name = next((c for c in free if wished[c] == 1), None) or _numbered(
                choices[source][-1], taken
            )
        taken.add(name)
        out.append(name)
    return out


def _choices(source: Path, stem: Callable[[Path], str]) -> Iterator[str]:
    yield stem(source)
    yield source.name
    folders = source.parent.parts[1:]
    for k in range(1, len(folders) + 1):
        front = _FOLDER_MARK.join(folders[-k:])
        yield f"{front}{_FOLDER_MARK}{stem(source)}"
        yield f"{front}{_FOLDER_MARK}{source.name}"


def _numbered(name: str, taken: set[str]) -> str:
    number = 2
    while f"{name}{_FOLDER_MARK}{number}" in taken:
        number += 1
    return f"{name}{_FOLDER_MARK}{number}"
