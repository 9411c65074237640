"""HTML as a tree, by Python's own parser, which refuses what is not closed."""

from __future__ import annotations

from collections.abc import Iterator
from html.parser import HTMLParser

VOID = {"meta", "img", "link", "br", "hr", "input", "wbr"}


class Node:
    def __init__(self, tag: str, attributes: dict[str, str]):
        self.tag = tag
        self.attributes = attributes
        self.children: list[Node | str] = []

    @property
    def text(self) -> str:
        """All text below, with single blanks."""
        parts = [c if isinstance(c, str) else c.text for c in self.children]
        return " ".join(" ".join(parts).split())

    def all(self, *tags: str) -> Iterator[Node]:
        """Elements below with one of these names; of any name without."""
        for child in self.children:
            if isinstance(child, Node):
                if not tags or child.tag in tags:
                    yield child
                yield from child.all(*tags)

    def one(self, tag: str) -> Node:
        (found,) = self.all(tag)
        return found

    def by_id(self, name: str) -> Node:
        (found,) = (n for n in self.all() if n.attributes.get("id") == name)
        return found


class _Builder(HTMLParser):
    def __init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self.root = Node("", {})
        self.open = [self.root]

    def handle_starttag(self, tag, attrs):
        node = Node(tag, {k: v or "" for k, v in attrs})
        assert len(node.attributes) == len(attrs), f"an attribute of {tag} twice: {attrs}"
        self.open[-1].children.append(node)
        if tag not in VOID:
            self.open.append(node)

    def handle_endtag(self, tag):
        assert self.open[-1].tag == tag, f"</{tag}> ends <{self.open[-1].tag}>"
        self.open.pop()

    def handle_data(self, data):
        self.open[-1].children.append(data)


def parse(html: str) -> Node:
    builder = _Builder()
    builder.feed(html)
    builder.close()
    assert builder.open == [builder.root], "not everything is closed"
    return builder.root


def table(root: Node, caption_id: str) -> list[dict[str, str]]:
    """Rows of the table with that caption, by column."""
    (found,) = (
        t for t in root.all("table") if t.one("caption").attributes["id"] == caption_id
    )
    names = [th.text for th in found.one("thead").all("th")]
    rows = [[c.text for c in tr.all("th", "td")] for tr in found.one("tbody").all("tr")]
    return [dict(zip(names, row, strict=True)) for row in rows]
