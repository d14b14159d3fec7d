"""Writes the method table, and a section for each of its rows."""
from __future__ import annotations

from gpgpu_rt.cli.help import described
from gpgpu_rt.cli.shared import word_of
from gpgpu_rt.methods import Method, methods
from gpgpu_rt.methods.references import reference
from gpgpu_rt.options import spell

from .markdown import code, plain, table


def methods_text() -> str:
    rows = list(methods())
    text = table(("method", "paper", "what it does", "schedules"), [
        (f"[{row.name}](#{row.name})", plain(row.citation), plain(row.summary),
         ", ".join(map(code, row.schedules))) for row in rows])
    return text + "".join(map(_section, rows))


def _section(row: Method) -> str:
    summary = plain(row.summary[0].upper() + row.summary[1:])
    era = row.why_no_era_form()
    return (f"\n## {row.name}\n\n{summary}.\n\nPaper: {plain(reference(row.citation))}.\n\n"
            f"Program: {code('glsl/' + str(row.glsl))}. Schedules: "
            f"{', '.join(map(code, row.schedules))}. "
            + (f"It has no [era form](../era.md): {plain(era)}." if era else
               "It has an [era form](../era.md).") + "\n\n" + table(
                ("option", "default", "meaning"),
                [(code(word_of(option.name)), default_of(option), plain(described(option)))
                 for option in row.options]))


def default_of(option) -> str:
    """Returns the cell of an option's default; empty for None, which the help explains."""
    if option.default is None:
        return ""
    return code("no" if option.default is False else "yes" if option.default is True
                else spell(option.default))
