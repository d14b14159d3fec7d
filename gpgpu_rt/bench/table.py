"""Table: writes races as a table for a paper, in LaTeX, or as a CSV file with all numbers."""
from __future__ import annotations

import csv
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ..disk.files import replacing
from .race import WORK, Entry

FORMATS = (".tex", ".csv")
Races = Sequence[tuple[Mapping[str, Any], str, Sequence[Entry]]]

_RATE = ("rays_per_second", "rays_per_second_q1", "rays_per_second_q3")
_TIME = ("ns_per_ray", "ns_per_ray_q1", "ns_per_ray_q3")
COLUMNS = ("scene", "triangles", "stand_in", "rays", "count", "name", "options", *_RATE, *_TIME,
           "spread", "over_embree", "over_embree_wall", "bytes_a_triangle", *WORK)


def write(path: str, races: Races, about: Sequence[str]) -> None:
    """Write a file with a row for each entry of each race.

    Parameters
    ----------
    path : the file; its suffix, one of FORMATS, chooses the format
    races : (facts of the scene, kind of rays, entries) of each race
    about : lines about the run, which become comments of the LaTeX file

    Raises
    ------
    Error
        if the file cannot be written
    """
    rows = [_row(facts, kind, entry) for facts, kind, entries in races for entry in entries]
    with replacing(path) as temporary:
        if Path(path).suffix.lower() == ".csv":
            with temporary.open("w", newline="", encoding="utf-8") as file:
                table = csv.DictWriter(file, COLUMNS, extrasaction="ignore")
                table.writeheader()
                table.writerows(rows)
        else:
            temporary.write_text("".join(line + "\n" for line in _latex(rows, about)),
                                 encoding="utf-8")


def _row(facts: Mapping[str, Any], kind: str, entry: Entry) -> dict[str, Any]:
    found = entry.to_dict()
    return {**found, **found["work"], "name": entry.name, "options": entry.words, "rays": kind,
            "count": entry.rays, "triangles": facts["triangles"], "scene": facts["scene"],
            "stand_in": facts["stand_in"] or ""}


def _latex(rows: Sequence[Mapping[str, Any]], about: Sequence[str]) -> list[str]:
    compared = any("over_embree" in row for row in rows)
    counted = [name for name in WORK if any(name in row for row in rows)]
    heads = ["scene", "rays", "method", "Mrays/s", "quartiles", *["/ embreex"] * compared,
             *(name.replace("_", " ") for name in counted)]
    lines = [f"% {line}" for line in about]
    lines += [rf"\begin{{tabular}}{{lll{'r' * (len(heads) - 3)}}}", r"\hline", _line(heads),
              r"\hline"]
    for row in rows:
        rate, low, high = (f"{row[name] / 1e6:.3g}" for name in _RATE)
        lines.append(_line([
            row["scene"] + " (stand-in)" * bool(row["stand_in"]), row["rays"],
            f"{row['name']} {row['options']}".rstrip(), rate, f"{low}--{high}",
            *[_number(row.get("over_embree"), 2)] * compared,
            *(_number(row.get(name), 1) for name in counted)]))
    return [*lines, r"\hline", r"\end{tabular}"]


def _number(value: float | None, digits: int) -> str:
    return "--" if value is None else f"{value:.{digits}f}"


def _line(cells: Sequence[str]) -> str:
    return " & ".join(re.sub(r"([&%$#_{}])", r"\\\1", cell) for cell in cells) + r" \\"
