"""Parser: an argument parser that reports a mistake in one line."""
from __future__ import annotations

import argparse
from typing import Any

from ..errors import did_you_mean, nearest_names


class Parser(argparse.ArgumentParser):
    """Reports what is wrong in one line and suggests similar words.

    Attributes
    ----------
    switches : the words that need no value, such as --octants
    """

    speaker = "gpgpu-rt"

    def __init__(self, *given: Any, **more: Any) -> None:
        super().__init__(*given, **more)
        self.switches: set[str] = set()

    def error(self, message: str) -> Any:
        self.exit(2, f"{self.speaker}: {message} (see `{self.prog} --help`)\n")

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        """Check a choice or a command; argparse calls this method."""
        if action.choices is not None and value not in action.choices:
            near = nearest_names(str(value), map(str, action.choices))
            raise argparse.ArgumentError(action, f"invalid choice {value!r}{near}")

    def refuse(self, word: str) -> None:
        """Report a word that no option or argument of this command accepts."""
        name = word.partition("=")[0]
        near = did_you_mean(name, self._option_string_actions) if name.startswith("-") else ""
        self.error(f"{self.prog.split()[-1]} has no {name}{near}")
