"""Lists the commands and their options, from the parsers of the command line."""
from __future__ import annotations

import argparse

from gpgpu_rt.cli.main import command_parser

from .markdown import code, plain, table

# This group of options is listed in reference/options.md instead.
SHARED = "options of the tracer and its methods"


def commands_text() -> str:
    parser = command_parser()
    commands, = (action for action in parser._actions
                 if isinstance(action, argparse._SubParsersAction))
    rows = _rows(parser, parser._optionals)
    return "".join(["\n## All commands\n\n" + table(("option", "meaning"), rows),
                    *(_section(name, one) for name, one in commands.choices.items())])


def _section(name: str, parser: argparse.ArgumentParser) -> str:
    text = f"\n## {name}\n\n{plain(_sentence(parser.description or ''))}\n"
    for group in parser._action_groups:
        rows = _rows(parser, group)
        if group.title == SHARED:
            text += "\nAlso every [option of the tracer and of the methods](options.md).\n"
        elif rows:
            own = group.title not in ("positional arguments", "options")
            text += (f"\n{plain(_sentence(str(group.title)))}\n" if own else "") + "\n" + table(
                ("argument" if group.title == "positional arguments" else "option", "meaning"),
                rows)
    return text


def _rows(parser: argparse.ArgumentParser, group: argparse._ArgumentGroup
          ) -> list[tuple[str, str]]:
    """Returns a row for each shown argument of a group, except --help."""
    shown = parser._get_formatter()
    return [(code(shown._format_action_invocation(action)),
             plain(shown._expand_help(action)) if action.help else "")
            for action in group._group_actions
            if action.help != argparse.SUPPRESS
            and not isinstance(action, (argparse._SubParsersAction, argparse._HelpAction))]


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:].rstrip(".") + "."
