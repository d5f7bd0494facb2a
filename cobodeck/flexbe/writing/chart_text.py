"""Charts as YAML that the engine reads as it was, with the authors' comments above."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any

import yaml

from cobodeck.flexbe.behaviour import Comment


def yaml_of(chart: Mapping[str, Any], comments: Iterable[Comment] = (), head: str = "") -> str:
    """A chart as YAML.

    `head` and the comments, each after the path of its container, come first, as comments.
    """
    lines = [*head.splitlines()]
    for comment in comments:
        mark = "Important: " if comment.important else ""
        where = f"{comment.path}: " if comment.path else ""
        lines += f"{where}{mark}{comment.text}".splitlines()
    above = "".join(f"# {_printable(line)}".rstrip() + "\n" for line in lines)
    return above + yaml.dump(
        dict(chart), Dumper=_Dumper, sort_keys=False, width=100, allow_unicode=True
    )


def _printable(line: str) -> str:
    return "".join(letter if letter.isprintable() else " " for letter in line)


class _Dumper(yaml.SafeDumper):
    """Writes what the engine reads: only `true`, `false`, `null` and numbers are not text."""

    yaml_implicit_resolvers: dict[Any, Any] = {}

    def increase_indent(self, flow: bool = False, indentless: bool = False) -> None:  # noqa: ARG002
        """Indent lists in mappings."""
        super().increase_indent(flow, False)

    def represent_mapping(self, tag: str, mapping: Any, flow_style: bool | None = None) -> Any:
        """Mappings of single values stand in one line."""
        node = super().represent_mapping(tag, mapping, flow_style)
        flat = all(isinstance(value, yaml.ScalarNode) for _, value in node.value)
        node.flow_style = flat or "if" in mapping
        return node

    def represent_sequence(self, tag: str, sequence: Any, flow_style: bool | None = None) -> Any:
        """So do lists of them."""
        node = super().represent_sequence(tag, sequence, flow_style)
        node.flow_style = all(isinstance(value, yaml.ScalarNode) for value in node.value)
        return node

    def represent_text(self, data: str) -> Any:
        """Text; with escapes where it holds what a reader would fold or refuse."""
        style = None if data.isprintable() else '"'
        return self.represent_scalar("tag:yaml.org,2002:str", data, style)

    def ignore_aliases(self, data: Any) -> bool:  # noqa: ARG002
        """Charts have none."""
        return True


for _tag, _pattern, _starts in (
    ("null", r"~|null|", ["~", "n", ""]),
    ("bool", r"true|false", ["t", "f"]),
    ("int", r"[-+]?(?:0|[1-9]\d*)", list("-+0123456789")),
    ("float", r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?", list("-+.0123456789")),
):
    _Dumper.add_implicit_resolver(
        f"tag:yaml.org,2002:{_tag}", re.compile(f"(?:{_pattern})\\Z"), _starts
    )
_Dumper.add_representer(str, _Dumper.represent_text)
