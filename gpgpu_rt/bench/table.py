"""Table: writes races as a table for a paper, in LaTeX, or as a CSV file with more numbers."""
from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ..disk.files import replacing
from ..text_format import number, printable, titled
from .race import WORK, Entry

FORMATS = (".tex", ".csv")
_RATE = ("rays_per_second", "rays_per_second_q1", "rays_per_second_q3")
_TIME = ("ns_per_ray", "ns_per_ray_q1", "ns_per_ray_q3")
COLUMNS = ("scene", "triangles", "stand_in", "rays", "count", "out_of", "name", "options", *_RATE,
           *_TIME, "spread", "over_embree", "over_embree_wall", "bytes_a_triangle", *WORK)
_ESCAPED = str.maketrans({**{sign: f"\\{sign}" for sign in "&%$#_{}"},
                          "\\": r"\textbackslash{}", "~": r"\textasciitilde{}",
                          "^": r"\textasciicircum{}"})


def write(path: str, races: Sequence[tuple[Mapping[str, Any], str, Sequence[Entry]]],
          about: Sequence[str]) -> None:
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
    return {**found, **found["work"], "options": entry.words, "rays": kind, "count": entry.rays,
            "triangles": facts["triangles"], "scene": printable(facts["scene"]),
            "stand_in": facts["stand_in"] or "", "label": entry.label}


def _latex(rows: Sequence[Mapping[str, Any]], about: Sequence[str]) -> list[str]:
    compared = ["over_embree"] * any("over_embree" in row for row in rows)
    counted = [name for name in WORK if any(name in row for row in rows)]
    heads = ["scene", "rays", "method", "Mrays/s", "quartiles", *["over embreex"] * len(compared),
             *(name.replace("_", " ") for name in counted)]
    lines = [f"% {printable(' '.join(line.split()))}" for line in about]
    lines += [rf"\begin{{tabular}}{{lll{'r' * (len(heads) - 3)}}}", r"\hline", _line(heads),
              r"\hline"]
    for row in rows:
        rate, low, high = (number(row[name] / 1e6) for name in _RATE)
        lines.append(_line([
            titled(row["scene"], row["stand_in"]), row["rays"], row["label"], rate,
            f"{low}--{high}", *(number(row.get(name)) for name in (*compared, *counted))]))
    return [*lines, r"\hline", r"\end{tabular}"]


def _line(cells: Sequence[str]) -> str:
    return " & ".join(cell.translate(_ESCAPED) for cell in cells) + r" \\"
