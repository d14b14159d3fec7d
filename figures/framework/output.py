"""Output: writes CSV, Markdown and charts. Each file is written whole or not at all."""
from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from gpgpu_rt.charts import plt, save
from gpgpu_rt.disk.files import replacing
from gpgpu_rt.text_format import number


def write_csv(path: Path, heads: Sequence[str], rows: Sequence[Sequence[Any]]) -> None:
    with replacing(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(heads)
        writer.writerows(rows)


def write_text(path: Path, text: str) -> None:
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def markdown_table(heads: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join("| " + " | ".join(str(cell) for cell in line) + " |" for line in lines) + "\n"


def save_chart(figure: Any, path: Path, footnote: str, shows: str) -> None:
    """Write a chart with a footnote under it.

    Parameters
    ----------
    shows : a sentence on what the chart shows, for readers who cannot see it
    """
    figure.text(0.01, 0.005, footnote, fontsize=7, color="#444444", va="bottom", wrap=True)
    save(figure, path, shows)


__all__ = ["markdown_table", "number", "plt", "save_chart", "write_csv", "write_text"]
