"""What the commands share: options from words, sizes, tables and JSON."""
from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from ..errors import OptionError
from ..methods import find_method, methods
from ..options import TRACER_OPTIONS, TRUTH, Option, spell
from ..scene import Scene

# Declares a command: its name, what runs it and its help.
Command = Callable[[str, Callable[[argparse.Namespace], None], str], argparse.ArgumentParser]


def all_options() -> dict[str, Option]:
    """Every option of every method, by name."""
    table = {option.name: option for option in TRACER_OPTIONS}
    for row in methods():
        table.update({option.name: option for option in row.options})
    return table


def add_options(sub: argparse.ArgumentParser) -> None:
    """A ``--word`` for every option of the tracer and its methods."""
    group = sub.add_argument_group("options of the tracer and its methods")
    for option in all_options().values():
        add_option(group, option, "option_")


def word_of(option: Option) -> str:
    """The option as it is written on the command line."""
    return "--" + option.name.replace("_", "-")


def add_option(group: argparse._ArgumentGroup, option: Option, prefix: str) -> None:
    """Its ``--word``, whose text is then found under ``prefix`` and its name."""
    choices = f" ({', '.join(map(spell, option.choices))})" if option.choices else ""
    bare = {"nargs": "?", "const": "true"} if option.kind is bool else {}
    default = spell(option.default).lower() if bare or option.default is None else spell(
        option.default)
    group.add_argument(word_of(option), dest=prefix + option.name,
                       metavar="true|false" if bare else "VALUE",
                       help=f"{option.help}{choices}; default {default}".replace("%", "%%"),
                       **bare)


def spelled_out(arguments: Sequence[str], options: Iterable[Option]) -> list[str]:
    """A bare switch as ``--word=true``: what follows it, such as a scene, is not its value."""
    switches = {word_of(option) for option in options if option.kind is bool}
    following = [*arguments[1:], ""]
    return [word + "=true" if word in switches and after.lower() not in TRUTH else word
            for word, after in zip(arguments, following)]


def given_options(chosen: argparse.Namespace) -> dict[str, Any]:
    """The options that were given, whatever method they belong to."""
    table = all_options()
    words = {name: getattr(chosen, "option_" + name) for name in table}
    return {name: table[name].parse(text) for name, text in words.items() if text is not None}


def options_for(chosen: argparse.Namespace, method: str) -> dict[str, Any]:
    """The options that were given; one that the method has not is refused."""
    return parsed(chosen, "option_", all_options(), TRACER_OPTIONS + find_method(method).options,
                  f"method {method}")


def parsed(chosen: argparse.Namespace, prefix: str, asked: Mapping[str, Option],
           known: Sequence[Option], whose: str) -> dict[str, Any]:
    """The options among those ``asked`` for under ``prefix`` that were given.

    Raises
    ------
    OptionError
        for one that is not ``known``, and so not ``whose``
    """
    table = {option.name: option for option in known}
    given = {}
    for name, option in asked.items():
        text = getattr(chosen, prefix + name)
        if text is None:
            continue
        if name not in table:
            raise OptionError(f"{whose} has no option {word_of(option)}")
        given[name] = table[name].parse(text)
    return given


def size_word(text: str) -> tuple[int, int]:
    """(width, height) of a word such as 512x512."""
    width, _, height = text.lower().partition("x")
    try:
        size = int(width), int(height or width)
    except ValueError:
        size = 0, 0
    if min(size) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is no size; give WIDTHxHEIGHT, as in 512x512")
    return size


def say(line: str) -> None:
    """Progress: to stderr, for stdout may be a table or JSON that something reads."""
    print(line, file=sys.stderr, flush=True)


def print_json(value: Any) -> None:
    print(json.dumps(value, indent=2, default=str))


def scene_facts(scene: Scene) -> dict[str, Any]:
    """What JSON says of the scene."""
    return {"scene": scene.name, "triangles": len(scene), "source": scene.source,
            "stand_in": scene.stand_in}


def print_stand_in(scene: Scene) -> None:
    """Say so where the scene is not the one of the papers."""
    if scene.stand_in:
        print(f"{scene.name} is a procedural stand-in for {scene.stand_in} "
              "(`gpgpu-rt scenes` says where the original is)")


def print_table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    widths = [max(len(str(row[k])) for row in [heads, *rows]) for k in range(len(heads))]
    for row in [heads, ["-" * w for w in widths], *rows]:
        print("  ".join(str(cell).ljust(w) for cell, w in zip(row, widths)).rstrip())
