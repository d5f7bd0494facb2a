"""XML elements with their line numbers, for errors that name the place."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from xml.parsers import expat

from engine.files import FileError, mistake


@dataclass(frozen=True, slots=True)
class Element:
    """An XML element with its line in the file."""

    tag: str
    attributes: Mapping[str, str]
    path: str
    line: int
    children: list[Element] = field(default_factory=list)

    def fail(self, message: str) -> FileError:
        """The error to raise for this element."""
        name = f" '{self.attributes['name']}'" if "name" in self.attributes else ""
        return mistake(self.path, f"<{self.tag}>{name} {message}", self.line)

    def all(self, tag: str) -> Iterator[Element]:
        """Children with this tag."""
        return (child for child in self.children if child.tag == tag)

    def within(self) -> Iterator[Element]:
        """All elements inside this one, in the order of the file."""
        ahead = self.children[::-1]
        while ahead:
            yield (found := ahead.pop())
            ahead += found.children[::-1]

    def first(self, tag: str) -> Element | None:
        """The first child with this tag; None without one."""
        return next(self.all(tag), None)

    def need(self, tag: str) -> Element:
        """The first child with this tag; an error without one."""
        found = self.first(tag)
        if found is None:
            raise self.fail(f"has no <{tag}>")
        return found

    def named(self, tag: str) -> dict[str, Element]:
        """Children with this tag by name; a repeated name is an error."""
        found: dict[str, Element] = {}
        for child in self.all(tag):
            name = child.text("name")
            if name in found:
                raise child.fail(f"stands twice, first in line {found[name].line}")
            found[name] = child
        return found

    def text(self, attribute: str) -> str:
        """A required attribute."""
        if attribute not in self.attributes:
            raise self.fail(f"has no attribute '{attribute}'")
        return self.attributes[attribute]

    def number(self, attribute: str, default: float) -> float:
        """An attribute as one finite number."""
        return self.numbers(attribute, (default,))[0]

    def numbers(self, attribute: str, default: tuple[float, ...]) -> tuple[float, ...]:
        """An attribute as finite numbers, as many as the default has."""
        if attribute not in self.attributes:
            return default
        written = self.attributes[attribute]
        try:
            found = tuple(float(word) for word in written.split())
        except ValueError:
            found = ()
        if len(found) != len(default) or not all(map(math.isfinite, found)):
            raise self.fail(f'has {attribute}="{written}"; needs {len(default)} finite numbers')
        return found


def elements(text: str, path: str) -> Element:
    """The root element of a file, with all others as its descendants.

    Raises:
        FileError: with file and line.
    """
    top = Element("", {}, path, 0)
    stack = [top]

    def start(tag: str, attributes: dict[str, str]) -> None:
        element = Element(tag, attributes, path, parser.CurrentLineNumber)
        stack[-1].children.append(element)
        stack.append(element)

    def refuse(*_: object) -> None:
        line = parser.CurrentLineNumber
        raise mistake(path, "has entities of its own; none are allowed", line)

    parser = expat.ParserCreate()
    parser.StartElementHandler = start
    parser.EndElementHandler = lambda _: stack.pop() and None
    parser.EntityDeclHandler = refuse
    try:
        parser.Parse(text, True)
    except expat.ExpatError as failure:
        reason = expat.errors.messages[failure.code]
        raise mistake(path, f"is not XML: {reason}", failure.lineno) from None
    return top.children[0]
