"""XML as data files need it: elements, attributes and text, and no more.

A document type, and with it every entity of its own, is refused: entities can blow up a
small file, and no file of measurements needs them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from xml.parsers import expat

from data_formats.measurement import MeasurementError
from data_formats.source import Source

_DEEPEST = 64
_SEPARATOR = "\n"  # never part of a name


@dataclass(eq=False)
class Element:
    """An element of a document.

    **Arguments:**

    - `name`: without name space.
    - `line`: of its start tag.
    - `attributes`: by their names as written.
    - `children`: the elements in it.
    - `parts`: pieces of its own text.
    """

    name: str
    line: int
    attributes: dict[str, str]
    children: list[Element] = field(default_factory=list)
    parts: list[str] = field(default_factory=list)

    @property
    def text(self) -> str:
        """Its own text, without blanks around it."""
        return "".join(self.parts).strip()

    def all(self, *path: str) -> Iterator[Element]:
        """The elements at a path of names below this one."""
        if not path:
            yield self
            return
        for child in self.children:
            if child.name == path[0]:
                yield from child.all(*path[1:])

    def at(self, *path: str) -> str:
        """The text of the first element at a path; `""` if there is none."""
        return next((e.text for e in self.all(*path)), "")


def parse(source: Source) -> Element:
    """The root element of a document.

    **Raises:** `MeasurementError` with the line if the file is not well-formed XML, is
    nested deeper than 64 elements, or has a document type.
    """
    parser = expat.ParserCreate(namespace_separator=_SEPARATOR)
    parser.buffer_text = True
    open_elements: list[Element] = []
    roots: list[Element] = []

    def start(name: str, attributes: dict[str, str]) -> None:
        line = parser.CurrentLineNumber
        if len(open_elements) >= _DEEPEST:
            raise MeasurementError(
                f"{source.path}, line {line}: more than {_DEEPEST} elements inside each "
                "other"
            )
        element = Element(name.rpartition(_SEPARATOR)[2], line, attributes)
        (open_elements[-1].children if open_elements else roots).append(element)
        open_elements.append(element)

    def end(name: str) -> None:
        open_elements.pop()

    def characters(text: str) -> None:
        open_elements[-1].parts.append(text)

    def refuse(*_: object) -> None:
        raise MeasurementError(
            f"{source.path}, line {parser.CurrentLineNumber}: the XML declares a document "
            "type or entities, which are not read; remove the DOCTYPE"
        )

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.CharacterDataHandler = characters
    parser.StartDoctypeDeclHandler = refuse
    parser.EntityDeclHandler = refuse
    try:
        parser.Parse(source.data, True)
    except MeasurementError:
        raise
    except (expat.ExpatError, ValueError, LookupError) as error:
        raise MeasurementError(f"{source.path}: the XML is damaged: {error}") from error
    return roots[0]
