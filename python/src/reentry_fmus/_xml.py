"""XML as elements that know their line, without namespaces."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat


@dataclass
class Node:
    """An element: its name without a prefix, its attributes, its children and its text."""

    tag: str
    attributes: dict[str, str]
    line: int
    children: list[Node] = field(default_factory=list)
    parts: list[str] = field(default_factory=lambda: [""])
    """Texts before, between and behind the children."""

    @property
    def text(self) -> str:
        """Text without that of the children."""
        return " ".join(self.parts)

    def all(self, *tags: str) -> Iterator[Node]:
        """Children with one of these names."""
        return (child for child in self.children if child.tag in tags)

    def one(self, *tags: str) -> Node | None:
        """First child with one of these names."""
        return next(self.all(*tags), None)


def parse(path: Path) -> Node:
    """Reads a file. Entities of a document type that lies elsewhere are left out.

    Raises:
        ValueError: the file is no XML; the message names the line.
    """
    parser = expat.ParserCreate()
    parser.UseForeignDTD(False)
    outer = Node("", {}, 0)
    open_nodes = [outer]

    def begin(tag: str, attributes: dict[str, str]) -> None:
        node = Node(tag.rpartition(":")[2], attributes, parser.CurrentLineNumber)
        open_nodes[-1].children.append(node)
        open_nodes.append(node)

    def end(_: str) -> None:
        open_nodes.pop()
        open_nodes[-1].parts.append("")

    def text(written: str) -> None:
        open_nodes[-1].parts[-1] += written

    parser.StartElementHandler, parser.EndElementHandler, parser.CharacterDataHandler = begin, end, text
    parser.buffer_text = True
    try:
        parser.Parse(path.read_bytes(), True)
    except expat.ExpatError as error:
        raise ValueError(f"{path}: {error}") from None
    return outer.children[0]
