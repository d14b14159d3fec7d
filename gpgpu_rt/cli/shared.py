"""Shared: parses options and sizes, and prints tables and JSON, for all commands."""
from __future__ import annotations

import argparse
import json
import math
import re
import sys
import textwrap
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import replace
from typing import Any

from ..errors import OptionError
from ..methods import find_method, methods
from ..options import TRACER_OPTIONS, TRUTH, Option
from ..scene.scene import Scene
from .era_messages import check_era, check_era_form
from .help import OwnedOptions, Variants, escaped, help_of, variants
from .parser import Parser

# (name of a command, function that runs it, help text) -> parser of the command
Command = Callable[[str, Callable[[argparse.Namespace], None], str], Parser]


WIDTH = 100     # columns of wrapped text, about the width of a wide table
NONE = "none"       # the word for no method or no engine
_WORD = re.compile(r"--[a-z-]+")
_PLACE = re.compile(r"-[\d.][^,]*,.*")     # a vector that begins with a negative number: -1,0,2


def all_owners() -> list[tuple[str, Sequence[Option]]]:
    """Return the tracer and every method, each with its options."""
    return [("the tracer", TRACER_OPTIONS), *((row.name, row.options) for row in methods())]


def all_options() -> Variants:
    return variants(all_owners())


def add_options(sub: Parser, words: tuple[str, ...] = ("-m", "--method", "--methods"),
                unowned: tuple[str, ...] = (), schedule: str = "loop") -> None:
    """Declare a ``--word`` for every option of the tracer and of the methods. ``words`` and
    ``unowned`` are as in `OwnedOptions`. ``schedule`` is the command's default schedule, which its
    help names."""
    group = sub.add_argument_group("options of the tracer and its methods")
    owners = [(owner, [replace(option, default=schedule) if option.name == "schedule" else option
                       for option in options]) for owner, options in all_owners()]
    add_variants(sub, group, OwnedOptions("method", owners, words, "the tracer", unowned),
                 "option_")


def names(text: str) -> list[str]:
    found = [name.strip() for name in text.split(",")]
    if not all(found):
        raise argparse.ArgumentTypeError(f"{text!r} has an empty name; give NAME,NAME,... without "
                                         "spaces")
    return found


class Collect(argparse.Action):
    """Adds names to the list that earlier uses of the option made; keeps each name once."""

    def __call__(self, parser: argparse.ArgumentParser, chosen: argparse.Namespace, values: Any,
                 word: str | None = None) -> None:
        before = getattr(chosen, self.dest) or []
        setattr(chosen, self.dest, list(dict.fromkeys([*before, *values])))


class _Single(argparse.Action):
    def __call__(self, parser: argparse.ArgumentParser, chosen: argparse.Namespace, value: Any,
                 word: str | None = None) -> None:
        before = getattr(chosen, self.dest)
        if before is not None:
            parser.error(f"{word} is given twice, {before} and {value}; this command takes one")
        setattr(chosen, self.dest, value)


def add_method(sub: argparse.ArgumentParser, text: str, required: bool = False) -> None:
    sub.add_argument("-m", "--method", required=required, action=_Single, metavar="NAME",
                     help=text)


def add_methods(sub: Parser, default: str | None = None, more: str = "") -> None:
    """Declare ``-m`` for several methods; ``chosen.methods`` is their list.

    ``default`` says in the help what applies without ``-m``. If ``default`` is None, ``-m`` is
    required. Otherwise, ``chosen.methods`` is None if the user gives no ``-m``. ``more`` is a
    further part of the help.
    """
    sub.listed = [row.name for row in methods()]
    sub.add_argument("-m", "--method", "--methods", required=default is None, action=Collect,
                     dest="methods", metavar="NAME,NAME,...", type=names,
                     help="; ".join(filter(None, (
                         "the methods, as a list or with an -m for each", more,
                         default and f"default: {default}"))))


def word_of(name: str) -> str:
    """Return an option's name as the command line writes it."""
    return "--" + name.replace("_", "-")


def add_variants(sub: Parser, group: argparse._ArgumentGroup, options: OwnedOptions,
                 prefix: str) -> None:
    """Declare a ``--word`` for each of the options, in a group of a command's parser. The parsed
    arguments have the user's text, or None, in the attribute ``prefix`` + name."""
    sub.own(options)
    for name, kinds in options.table.items():
        bare = {"nargs": "?", "const": "true"} if _is_switch(kinds) else {}
        sub.switches.update([word_of(name)] if bare else [])
        try:
            action = group.add_argument(word_of(name), dest=prefix + name,
                                        metavar="true|false" if bare else "VALUE",
                                        help=escaped(help_of(kinds)), **bare)
        except argparse.ArgumentError:      # the command itself has an option of this name
            owner = [owner for owners in kinds.values() for owner in owners][-1]
            raise OptionError(f"{find_method(owner).glsl}: method {owner} has an option {name}, "
                              f"but the commands use {word_of(name)} themselves; give the option "
                              "another name") from None
        options.actions[action] = name


def _is_switch(kinds: Iterable[Option]) -> bool:
    return any(option.kind is bool for option in kinds)


def spelled_out(arguments: Sequence[str], switches: Collection[str]) -> list[str]:
    """Return the arguments in a form that argparse reads without ambiguity.

    A switch without a value becomes ``--word=true``, because argparse would read the next argument
    as the value. A vector such as -1,0,2 is joined to the word before it, because argparse would
    read the vector as an option.
    """
    found: list[str] = []
    for word, after in zip(arguments, [*arguments[1:], ""]):
        if found and _PLACE.fullmatch(word) and _WORD.fullmatch(found[-1]):
            found[-1] += "=" + word
        else:
            bare = word in switches and after.lower() not in TRUTH
            found.append(word + "=true" if bare else word)
    return found


def given_options(chosen: argparse.Namespace) -> dict[str, Any]:
    """Return name -> value of all options that the user gave. If several methods' options share
    a name, the first option that accepts the text parses the text."""
    table = all_options()
    words = {name: getattr(chosen, "option_" + name) for name in table}
    return {name: _read(list(table[name]), text) for name, text in words.items()
            if text is not None}


def _read(kinds: Sequence[Option], text: str) -> Any:
    for option in kinds[:-1]:
        try:
            return option.parse(text)
        except OptionError:
            continue
    return _parse(kinds[-1], text)


def _parse(option: Option, text: str) -> Any:
    if option.name == "era":
        check_era(text)
    return option.parse(text)


def options_for(chosen: argparse.Namespace, method: str) -> dict[str, Any]:
    """Return name -> value of the options that the user gave for the method.

    Raises
    ------
    OptionError
        for an option that the method does not have, or an invalid value
    """
    given = parsed(chosen, "option_", all_options(), TRACER_OPTIONS + find_method(method).options,
                   f"method {method}")
    if given.get("era"):
        check_era_form(method, str(given["era"]))
    return given


def parsed(chosen: argparse.Namespace, prefix: str, asked: Iterable[str],
           known: Sequence[Option], whose: str) -> dict[str, Any]:
    """Return name -> parsed value of the options that the user gave.

    Parameters
    ----------
    chosen, prefix : the parsed arguments, whose attribute ``prefix`` + name is an option's text
    asked : the names of the options to look for
    known, whose : the options of an owner, such as a method, and the owner's name

    Raises
    ------
    OptionError
        for an option that the owner does not have, or an invalid value
    """
    table = {option.name: option for option in known}
    given = {}
    for name in asked:
        text = getattr(chosen, prefix + name)
        if text is None:
            continue
        if name not in table:
            raise OptionError(f"{whose} has no option {word_of(name)}{_whose(name)}")
        try:
            given[name] = _parse(table[name], text)
        except OptionError as failure:
            raise OptionError(f"{whose}: {failure}") from failure
    return given


def _whose(name: str) -> str:
    owners = [row.name for row in methods() if name in {option.name for option in row.options}]
    return f"; {', '.join(owners)} {'has' if len(owners) == 1 else 'have'} it" if owners else ""


def size_word(text: str) -> tuple[int, int]:
    """Return (width, height) from a word such as 512x512."""
    width, cross, height = text.lower().partition("x")
    try:
        size = int(width), int(height if cross else width)
    except ValueError:
        size = 0, 0
    if min(size) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a size; give WIDTHxHEIGHT, as in "
                                         "512x512")
    return size


def side_word(text: str) -> int:
    """Return the side of a square in pixels, from 512 or 512x512."""
    try:
        width, height = size_word(text)
    except argparse.ArgumentTypeError:
        width, height = 0, -1
    if width != height:
        raise argparse.ArgumentTypeError(
            f"{text!r} is not the side of a square; give pixels, as in 512")
    return width


def whole_word(text: str, least: int = 0) -> int:
    if not text.isdecimal() or int(text) < least:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number of {least} or more")
    return int(text)


def count_word(text: str) -> int:
    return whole_word(text, 1)


def seconds_word(text: str) -> float:
    try:
        seconds = float(text)
    except ValueError:
        seconds = math.nan
    if not 0 <= seconds < math.inf:
        raise argparse.ArgumentTypeError(f"{text!r} is not a time; give seconds, 0 or more")
    return seconds


def print_any_name() -> None:
    """Let stdout and stderr print backslash sequences for characters that the terminal's encoding
    lacks, for example in file names."""
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")


def say(line: str) -> None:
    """Print a line about progress, to stderr: a program may read stdout."""
    print(line, file=sys.stderr, flush=True)


def print_json(value: Any) -> None:
    print(json.dumps(value, indent=2, default=str))


def print_stand_in(scene: Scene, json_follows: bool) -> None:
    """Print a line if the scene is a stand-in: to stderr if the command prints JSON to stdout."""
    if scene.stand_in:
        tell = say if json_follows else print
        tell(f"{scene.name} is a procedural stand-in for {scene.stand_in} "
             "(`gpgpu-rt scenes` says how to get the original)")


def print_filled(text: str) -> None:
    """Print a sentence in lines of at most WIDTH columns."""
    print(textwrap.fill(text, WIDTH, break_on_hyphens=False))


def print_table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    widths = [max(len(str(row[k])) for row in [heads, *rows]) for k in range(len(heads))]
    for row in [heads, ["-" * w for w in widths], *rows]:
        print_row(row, widths)


def print_row(cells: Sequence[str], widths: Sequence[int]) -> None:
    """Print and flush a row of a table. ``widths`` are the widths of the columns in characters."""
    print("  ".join(str(cell).ljust(w) for cell, w in zip(cells, widths)).rstrip(), flush=True)
