"""Parser: an argument parser that reports a mistake in one line (help.py composes the help)."""
from __future__ import annotations

import argparse
from collections.abc import Collection, Sequence
from typing import Any

from ..errors import did_you_mean, nearest_names
from .help import OwnedOptions, of_owners, short, usage_of, where_to_read_on

# The options that take a list of methods.
LISTS = ("-m", "--method", "--methods", "--predict")


def _whole_number(text: str) -> int:
    """Read an argument of ``type=int``. Argparse itself would say only "invalid int value"."""
    try:
        return int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number; give a number such as 8"
                                         ) from None


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number; give a number such as 0.5"
                                         ) from None


class _HelpAll(argparse.Action):
    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        assert isinstance(parser, Parser)
        parser.in_full = True
        parser.print_help()
        parser.exit()


class Parser(argparse.ArgumentParser):
    """Reports a mistake in one line, and suggests similar words.

    Attributes
    ----------
    switches : Words that need no value, such as --octants.
    owned : Options that belong to methods or integrators. If there are any, ``--help`` leaves
        out the group ``rare`` and most owned options.
    in_full : Whether the help has every option.
    instead : Word that the command does not accept -> clause that says what to do instead.
    listed : Names that an option of this command accepts as a list with commas.
    """

    speaker = "gpgpu-rt"

    def __init__(self, *given: Any, **more: Any) -> None:
        super().__init__(*given, **more)
        self.switches: set[str] = set()
        self.owned: list[OwnedOptions] = []
        self.in_full = False
        self.instead: dict[str, str] = {}
        self.listed: Collection[str] = ()
        self._arguments: Sequence[str] = ()
        self._rare: argparse._ArgumentGroup | None = None
        self.register("type", int, _whole_number)
        self.register("type", float, _number)

    @property
    def rare(self) -> argparse._ArgumentGroup:
        """The group for options that few users need."""
        self._rare = self._rare or self.add_argument_group("more options")
        return self._rare

    def own(self, options: OwnedOptions) -> None:
        """Add options of methods or integrators to the help. The caller also declares each
        option as an argument."""
        if not self.owned:
            self.add_argument("--help-all", action=_HelpAll, nargs=0, default=argparse.SUPPRESS,
                              help="show every option and exit")
        self.owned.append(options)

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        self._arguments = list(args or ())
        return super().parse_known_args(args, namespace)

    def format_help(self) -> str:
        if not self.owned:
            return super().format_help()
        formatter = self._get_formatter()
        formatter.add_usage(usage_of(self._actions), (), ())
        groups = [(group.title, list(group._group_actions)) for group in self._action_groups
                  if self.in_full or group is not self._rare]
        chosen = [] if self.in_full else of_owners(self.owned, self._arguments)
        if not chosen:
            formatter.add_text(self.description)
        for title, actions in chosen or (groups if self.in_full else short(groups, self.owned)):
            formatter.start_section(title)
            formatter.add_arguments(actions)
            formatter.end_section()
            if chosen and not actions:
                formatter.add_text(f"{title}: none")
        if not self.in_full:
            formatter.add_text(where_to_read_on(self.owned, bool(chosen)))
        return formatter.format_help()

    def error(self, message: str) -> Any:
        self.exit(2, f"{self.speaker}: {message} (see `{self.prog} --help`)\n")

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        """Raise ArgumentError with similar words if ``value`` is no choice or command; argparse
        calls this method."""
        if action.choices is not None and value not in action.choices:
            near = nearest_names(str(value), map(str, action.choices))
            raise argparse.ArgumentError(action, f"invalid choice {value!r}{near}")

    def refuse(self, word: str) -> None:
        """Report a word that the command does not accept."""
        command = self.prog.split()[-1]
        if not word.startswith("-"):
            self.error(f"{command} {self._of_list(word) or self._of_arguments(word)}")
        name = word.partition("=")[0]
        hint = self.instead.get(name) or did_you_mean(name, self._option_string_actions)
        self.error(f"{command} has no {name}{hint}")

    def _of_list(self, word: str) -> str:
        """Return advice if ``word`` follows an option's list and belongs to this list, else ""."""
        at = self._arguments.index(word)
        option, before = ["", "", *self._arguments][at:at + 2]
        words = before.split(",")
        if option not in LISTS or not all(one in self.listed for one in (word, *words)):
            return ""
        return f"takes a list with commas; give {option} {before},{word}"

    def _of_arguments(self, word: str) -> str:
        own = self._get_positional_actions()
        names = [str(action.metavar or action.dest) for action in own]
        if not own:
            return f"takes no arguments; leave {word} out"
        if own[-1].nargs in ("*", "+"):
            return f"needs every {names[-1]} before the first option; move {word} there"
        return f"takes one {' and one '.join(names)}; run {self.prog} again for {word}"
