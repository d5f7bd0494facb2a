"""Print what completes commands, options and names in a shell.

bash, in ~/.bashrc:

    eval "$(cobodeck completion bash)"

zsh, in ~/.zshrc after compinit:

    eval "$(cobodeck completion zsh)"

fish, in ~/.config/fish/config.fish:

    cobodeck completion fish | source
"""

from __future__ import annotations

import argparse
import os
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib import import_module
from itertools import pairwise

from cobodeck.terminal import OK, CommandParser, show
from engine.files.declared import YAML

SHELLS = {
    "bash": """\
_cobodeck() {
  local one words=("${COMP_WORDS[@]:1:COMP_CWORD}")
  COMPREPLY=()
  while IFS= read -r one; do
    COMPREPLY+=("$one")
  done < <(cobodeck completion bash "${words[@]/#/=}" 2>/dev/null)
  [[ ${#COMPREPLY[@]} -eq 1 && $COMPREPLY == */ ]] && compopt -o nospace
  return 0
}
complete -F _cobodeck cobodeck""",
    "zsh": """\
_cobodeck() {
  local -a found folders typed
  typed=("${(@Q)words[2,CURRENT]}")
  found=(${(f)"$(cobodeck completion zsh "=${(@)^typed}" 2>/dev/null)"})
  folders=(${(M)found:#*/})
  found=(${found:#*/})
  compadd -U -Q -- ${(q)found}
  compadd -U -Q -S '' -- ${(q)folders}
}
compdef _cobodeck cobodeck""",
    "fish": """\
function __cobodeck
  set -l words (commandline -opc) (commandline -ct)
  cobodeck completion fish "="$words[2..-1] 2>/dev/null
end
complete -c cobodeck -f -a '(__cobodeck)'""",
}
"""By shell a script that asks `completion SHELL =WORD…` for what the last word can become.

The equals sign keeps a word from being an option of `completion`. bash gives words as they were
typed, with quotes and backslashes, and takes them so; the other shells take them off and put them
on themselves.
"""
QUOTES = ("'", '"')
_SPECIAL = {"": re.compile(r"[^\w@%+=:,./-]"), '"': re.compile(r'[$`"\\]')}
"""By what a word begins with, the characters that bash takes as they are behind a backslash."""
_IMPOSSIBLE = {"'": "'", '"': "!"}
"""By what a word begins with, the character that cannot stand in it."""

NAMED: Mapping[str, Sequence[str]] = {
    "chart": ("charts", *YAML, ".mcap"),
    "shadow": ("charts", *YAML),
    "scene": ("scenes", *YAML),
    "place": ("scenes", *YAML),
    "profile": ("profiles", *YAML),
    "robot": ("robots", "connections", *YAML),
    "user": ("users", *YAML, ".csv", ".txt", ".mcap"),
    "campaign": ("campaigns", *YAML),
    "things": ("charts", *YAML, ".mcap"),
    "names": ("benches", ".mcap"),
}
"""By an argument's `dest`, the kinds of names and the files that it takes."""
PATHS = ("FILE", "DIR", "PATH", "LOG", "RECORD", "X.", "Y.", "A", "B", "MAP")
"""The metavar of an argument that takes a path has one of these words."""


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("shell", choices=tuple(SHELLS), metavar="SHELL", help=", ".join(SHELLS))
    parser.add_argument("words", nargs="*", help=argparse.SUPPRESS)


def run(args: argparse.Namespace) -> int:
    """Print the script, or what the last of the words can become."""
    if not args.words:
        show(SHELLS[args.shell])
        return OK
    typed = [word.removeprefix("=") for word in args.words]
    if args.shell == "bash":
        found = _found_in_bash(typed, args)
    else:
        *before, last = typed
        found = _found(before, last, args)
    for one in sorted(set(found)):
        show(one)
    return OK


def _found_in_bash(typed: Sequence[str], args: argparse.Namespace) -> list[str]:
    """What the last piece can become, quoted as it was begun."""
    *before, last = _whole([_unquoted(word) for word in typed])
    piece = "" if typed[-1] in ("=", ":") else typed[-1]
    cut = len(last) - len(_unquoted(piece))
    quote = piece[:1] if piece.startswith(QUOTES) else ""
    found = [one[cut:] for one in _found(before, last, args)]
    return [_quoted(one, quote) for one in found if _IMPOSSIBLE.get(quote, "\n") not in one]


def _unquoted(word: str) -> str:
    """A word without bash's quotes and backslashes; nothing in it is expanded."""
    found, quote, letters = [], "", iter(word)
    for letter in letters:
        if letter == quote:
            quote = ""
        elif not quote and letter in QUOTES:
            quote = letter
        elif letter == "\\" and quote != "'":
            after = next(letters, "")
            found.append(after if not quote or _SPECIAL[quote].match(after) else letter + after)
        else:
            found.append(letter)
    return "".join(found)


def _quoted(name: str, quote: str) -> str:
    """A name with a backslash before what is special to bash, behind such a quote or none."""
    return _SPECIAL[quote].sub(r"\\\g<0>", name) if quote in _SPECIAL else name


def _whole(words: Sequence[str]) -> list[str]:
    """The words as they were typed: bash tears them at `=` and `:`."""
    found: list[str] = []
    for before, word in pairwise(["", *words]):
        if found and (word in ("=", ":") or before in ("=", ":")):
            found[-1] += word
        else:
            found.append(word)
    return found


def _found(before: Sequence[str], last: str, args: argparse.Namespace) -> list[str]:
    """What the last word can become after those before it."""
    if not before:
        return [name for name in args.commands if name.startswith(last)]
    if before[0] not in args.commands:
        return []
    parser = args.parser_of(before[0])
    options = parser.options
    if last.startswith("-"):
        name, equals, value = last.partition("=")
        if equals and name in options:
            return [f"{name}={one}" for one in _values(options[name], value, before, args)]
        return [name for name in options if name.startswith(last)]
    action = _action(parser, before[1:])
    return [] if action is None else _values(action, last, before, args)


def _action(parser: CommandParser, before: Sequence[str]) -> argparse.Action | None:
    """The option or positional argument to which a word after these belongs."""
    taken, option = 0, None
    for word in before:
        if word.startswith("-") and len(word) > 1:
            option = None if "=" in word else parser.options.get(word)
            option = None if option is None or option.nargs == 0 else option
        elif option is None:
            taken += 1
        elif option.nargs not in ("+", "*"):
            option = None
    if option is not None:
        return option
    there = parser.positionals
    if there and there[-1].nargs in ("+", "*"):
        taken = min(taken, len(there) - 1)
    return there[taken] if taken < len(there) else None


def _values(
    action: argparse.Action, begun: str, before: Sequence[str], args: argparse.Namespace
) -> list[str]:
    """What an argument's value, begun like this, can become."""
    takes = NAMED.get(action.dest, ())
    if before[0] == "list" and action.dest == "name":
        takes = before[1:2]
    endings = tuple(one for one in takes if one.startswith("."))
    if action.choices is not None:
        names = [str(choice) for choice in action.choices]
    else:
        names = [name for kind in takes if kind in NAMES for name in NAMES[kind](args)]
    if not takes and any(word in _words(action.metavar) for word in PATHS):
        endings = ("",)
    return [name for name in names if name.startswith(begun)] + _files(begun, endings)


def _words(metavar: str | tuple[str, ...] | None) -> str:
    return metavar if isinstance(metavar, str) else ""


def _files(begun: str, endings: tuple[str, ...]) -> list[str]:
    """The files with these endings, and the folders, whose path begins like this."""
    folder, _, name = begun.rpartition("/")
    if not endings:
        return []
    stem = f"{folder}/" if "/" in begun else ""
    try:
        entries = list(os.scandir(stem or "."))
    except OSError:
        return []
    return [
        f"{stem}{one.name}{'/' if one.is_dir() else ''}"
        for one in entries
        if one.name.startswith(name) and (name or not one.name.startswith("."))
        if one.is_dir() or one.name.endswith(endings)
    ]


def _charts(args: argparse.Namespace) -> Iterable[str]:
    from cobodeck.project import names_of_charts

    return names_of_charts(own=args.own)


def _states(args: argparse.Namespace) -> Iterable[str]:
    from cobodeck.project import catalogue

    return catalogue(own=args.own).interfaces


def _users(_args: argparse.Namespace) -> Iterable[str]:
    from hw.people.walking import MANNERS, route, script_names, wanderer

    kinds = [f"{wanderer.NAME}:{manner}" for manner in MANNERS]
    return [*script_names(), wanderer.NAME, route.NAME, *kinds]


def _called(module: str, name: str) -> Callable[[argparse.Namespace], Iterable[str]]:
    return lambda _args: getattr(import_module(module), name)()


NAMES: Mapping[str, Callable[[argparse.Namespace], Iterable[str]]] = {
    "charts": _charts,
    "states": _states,
    "scenes": _called("hw.scene", "scene_names"),
    "users": _users,
    "profiles": _called("behaviors.profile", "profile_names"),
    "robots": _called("hw.model", "robot_names"),
    "arms": _called("hw.model", "arm_names"),
    "connections": _called("hw.connection", "connection_names"),
    "campaigns": _called("cobodeck.campaign", "campaign_names"),
    "benches": lambda _args: import_module("cobodeck.commands.bench").BENCHES,
}
"""By kind, the names that there are; only those of `states` need code to be imported."""
