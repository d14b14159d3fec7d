"""Help: composes the help of a command in three lengths.

``--help`` prints the options that everybody uses: it omits the group `Parser.rare`, and each
method option that is not marked ``common`` (``options.py``). ``-m METHOD --help`` prints the
options of a method, and ``--help-all`` prints every option.
"""
from __future__ import annotations

import argparse
import copy
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from ..errors import OptionError, nearest_names
from ..options import Option, spell

# Name -> the options with this name, each with the names of its owners (such as methods).
Variants = dict[str, dict[Option, list[str]]]
Section = tuple[str | None, list[argparse.Action]]      # a title, and the options below it


def variants(owners: Iterable[tuple[str, Sequence[Option]]]) -> Variants:
    """Return name -> options with this name -> their owners."""
    found: Variants = {}
    for owner, options in owners:
        for option in options:
            found.setdefault(option.name, {}).setdefault(option, []).append(owner)
    return found


@dataclass
class OwnedOptions:
    """Options of a command that belong to owners, such as methods.

    Attributes
    ----------
    kind : what an owner is called, such as "method"
    owned : the name and the options of each owner
    words : the words before an owner's name, such as -m; empty if the owner's name is an argument
        of the command
    everywhere : an owner that the user cannot name, and whose options apply to all other owners;
        "" if there is none
    unowned : names that may follow ``words`` although they own no options, such as auto
    table : name -> the options with this name, each with its owners
    actions : the parser's action -> the option's name
    """

    kind: str
    owned: Sequence[tuple[str, Sequence[Option]]]
    words: tuple[str, ...]
    everywhere: str = ""
    unowned: tuple[str, ...] = ()
    table: Variants = field(init=False)
    actions: dict[argparse.Action, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.table = variants(self.owned)

    def named(self, arguments: Sequence[str]) -> list[str]:
        """Return the owners whose names are among a command's arguments.

        Raises
        ------
        OptionError
            for a name that is neither an owner nor one of ``unowned``
        """
        owners = [owner for owner, _ in self.owned if owner != self.everywhere]
        if not self.words:
            return [owner for owner in owners if owner in arguments]
        scan = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
        scan.add_argument(*self.words, dest="texts", action="append", nargs="?", default=[])
        texts = scan.parse_known_args(list(arguments))[0].texts
        # A name may be followed by options, as in -m "bvh-packet octants".
        found = [(name.split() or [""])[0] for text in texts if text for name in text.split(",")]
        for name in found:
            if name not in (*owners, *self.unowned):
                raise OptionError(f"no {self.kind} {name!r}{nearest_names(name, owners)}")
        return [name for name in dict.fromkeys(found) if name in owners]

    def of(self, owner: str) -> list[argparse.Action]:
        """Return an owner's options, with help texts for this owner alone."""
        found = []
        for action, name in self.actions.items():
            kinds = {option: [owner] for option, owners in self.table[name].items()
                     if owner in owners}
            if kinds:
                own = copy.copy(action)
                own.help = escaped(help_of(kinds))
                found.append(own)
        return found

    def is_common(self, action: argparse.Action) -> bool:
        """Return whether the short help lists an option."""
        return any(option.common for option in self.table[self.actions[action]])


def short(groups: Sequence[Section], owned: Sequence[OwnedOptions]) -> Iterator[Section]:
    """Yield the sections of the short help, with only the common options of owners."""
    owner_of = {action: options for options in owned for action in options.actions}
    for title, actions in groups:
        yield title, [action for action in actions
                      if action not in owner_of or owner_of[action].is_common(action)]


def of_owners(owned: Sequence[OwnedOptions], arguments: Sequence[str]) -> list[Section]:
    return [(f"options of {options.kind} {name}", options.of(name))
            for options in owned for name in options.named(arguments)]


def usage_of(actions: Iterable[argparse.Action]) -> str:
    """Return a command's usage, with only required options and arguments."""
    words = ["%(prog)s [options]"]
    for action in sorted(actions, key=lambda action: not action.option_strings):
        name = escaped(str(action.metavar or action.dest))
        if action.option_strings and action.required:
            words.append(f"{action.option_strings[0]} {name}")
        elif not action.option_strings:
            words.append({"?": f"[{name}]", "*": f"[{name} ...]", "+": f"{name} [{name} ...]"
                          }.get(str(action.nargs), name))
    return " ".join(words)


def where_to_read_on(owned: Sequence[OwnedOptions], already: bool) -> str:
    """Return how to see the options that this help omits. ``already`` says whether the help
    already lists an owner's options."""
    ways = [] if already else [
        f"{' '.join([*options.words[:1], options.kind.upper()])} --help for the options of "
        f"{_article(options.kind)}" for options in owned]
    return f"Add {', '.join([*ways, '--help-all for every option'])}."


def described(option: Option) -> str:
    """Return an option's help text with its choices before "; default:"."""
    text, *default = option.help.partition("; default:")
    choices = f" ({', '.join(map(spell, option.choices))})" if option.choices else ""
    return text + choices + "".join(default)


def help_of(kinds: Mapping[Option, Sequence[str]]) -> str:
    """Return the help text of a word such as --octants, which may be an option of several methods.

    Options with equal texts share the text. If there are several texts, each text begins with the
    names of its methods. If a text has several defaults, each default is followed by its methods:
    "default 10 for lbvh, 2 for hybrid".
    """
    texts: dict[str, dict[str, list[str]]] = {}
    for option, owners in kinds.items():
        default = spell(option.default)
        if option.kind is bool or option.default is None:
            default = "" if "default:" in option.help else default.lower()
        defaults = texts.setdefault(described(option), {})
        defaults.setdefault(default, []).extend(owners)
    sentences = []
    for text, defaults in texts.items():
        whose = _listed([owner for owners in defaults.values() for owner in owners])
        ends = [default + (f" for {_listed(owners)}" if len(defaults) > 1 else "")
                for default, owners in defaults.items() if default]
        sentences.append((f"{whose}: " if len(texts) > 1 else "") + text
                         + (f"; default {', '.join(ends)}" if ends else ""))
    return ". ".join(sentences)


def escaped(text: str) -> str:
    """Return the text with doubled percent signs; argparse prints a pair as one sign."""
    return text.replace("%", "%%")


def _listed(owners: Sequence[str]) -> str:
    return ", ".join(owners) if len(owners) < 4 else f"{owners[0]} and {len(owners) - 1} others"


def _article(noun: str) -> str:
    return ("an " if noun[0] in "aeiou" else "a ") + noun
