"""Generates the texts that replace marks in pages of the reference, and the pages of the API."""
from __future__ import annotations

from collections.abc import Callable, Iterator

from .api_pages import api_pages, api_table
from .command_pages import commands_text
from .method_pages import methods_text
from .option_pages import options_text
from .program_pages import programs_text
from .record_pages import records_text

# The word of a mark ``<!-- generated: WORD -->`` -> the function that returns the Markdown.
PAGES: dict[str, Callable[[], str]] = {
    "api": api_table, "commands": commands_text, "methods": methods_text,
    "options": options_text, "programs": programs_text, "records": records_text}


def generate() -> Iterator[tuple[str, str]]:
    yield from api_pages()
