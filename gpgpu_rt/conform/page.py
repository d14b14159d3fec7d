"""Page: writes the results of the suite as one HTML file without scripts."""
from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape

import numpy as np

from ..disk.files import replacing
from .families import FAMILIES
from .suite import KINDS, Row, notes_of

_STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; margin: 2em auto; max-width: 75em; padding: 0 1em }
.wide { overflow-x: auto } table { border-collapse: collapse; font-variant-numeric: tabular-nums }
th, td { padding: 0.2em 0.6em; text-align: right; white-space: nowrap }
th:first-child, td:first-child { text-align: left; position: sticky; left: 0; background: white }
thead th { border-bottom: 1px solid #888 } tbody tr:hover td { outline: 1px solid #ccc }
.none { color: #888 } caption { text-align: left; padding: 0.5em 0 }
"""


def write_page(rows: Sequence[Row], missing: Mapping[str, str], path: str) -> None:
    """Write the suite's results to an HTML file.

    Parameters
    ----------
    missing : engine -> the reason why the engine was not run
    """
    with replacing(path) as file:
        file.write_text(page(rows, missing), encoding="utf-8")


def page(rows: Sequence[Row], missing: Mapping[str, str]) -> str:
    engines = list(dict.fromkeys(row.engine for row in rows))
    families = list(dict.fromkeys(row.family for row in rows))
    cells = {(row.engine, row.family): row for row in rows}
    versions = {row.engine: row.version for row in rows}
    body = [_table("Wrong rays out of rays cast. A dash means that the engine does not accept "
                   "the family's intervals of t, that it gave no answer in an earlier family, or "
                   "that it cannot be loaded.",
                   ["family", *(f"{one} {versions[one]}".strip() for one in engines)],
                   [[f'<td title="{escape(FAMILIES[name].what)}">{escape(name)}</td>',
                     *(_cell(cells[one, name]) for one in engines)] for name in families]),
            _table("All families together, by kind.", ["engine", "rays", *KINDS, "wrapper's own"],
                   [_sums([row for row in rows if row.engine == one]) for one in engines])]
    listed = "".join(f"<li>{escape(note)}</li>" for note in notes_of(rows, missing))
    return ("<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
            "<meta name=\"viewport\" content=\"width=device-width\">"
            f"<title>Conformance of ray tracers</title><style>{_STYLE}</style></head><body>"
            "<h1>Conformance of ray tracers</h1><p>Each family of rays is aimed at difficult "
            "places: edges, vertices or the limits of float32. The right answers are exact. If "
            "float32 cannot decide a ray, the ray counts neither for nor against a tracer. The "
            "counts say nothing about ordinary rays.</p>"
            f"{''.join(body)}<ul>{listed}</ul></body></html>\n")


def _table(caption: str, heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    head = "".join(f"<th>{escape(one)}</th>" for one in heads)
    body = "".join(f"<tr>{''.join(row)}</tr>" for row in rows)
    return (f"<div class=\"wide\"><table><caption>{escape(caption)}</caption><thead><tr>{head}"
            f"</tr></thead><tbody>{body}</tbody></table></div>")


def _cell(row: Row) -> str:
    if not row.rays:
        return '<td class="none">-</td>'
    if not row.wrong_rays:
        return f'<td class="none">0/{row.rays}</td>'
    share = row.wrong_rays / row.rays
    strength = 0.15 + 0.2125 * max(0.0, float(np.log10(share)) + 4)
    words = row.failure or f"{row.wrong_rays}/{row.rays}"
    told = ", ".join(f"{kind}: {count}" for kind, count in row.wrong.items() if count)
    return (f'<td title="{escape(row.note or told)}" style="background: '
            f'rgba(200, 40, 30, {min(strength, 1):.2f})">{words}</td>')


def _sums(rows: Sequence[Row]) -> list[str]:
    own = [row.own for row in rows if row.own is not None]
    values = [sum(row.rays for row in rows),
              *(sum(row.wrong[kind] for row in rows) for kind in KINDS),
              sum(own) if own else "-"]
    return [f"<td>{escape(rows[0].engine)}</td>", *(f"<td>{value}</td>" for value in values)]
