"""Output of figures: CSV, Markdown and charts. Each file is written whole or not at all."""
from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  (the backend must be chosen first)

from gpgpu_rt.bench.engines import EMBREE  # noqa: E402
from gpgpu_rt.disk.files import replacing  # noqa: E402
from gpgpu_rt.text_format import number  # noqa: E402

COLOURS = {"brute-force": "#8c8c8c", "grid": "#c98a1b", "grid-proximity": "#e3b65b",
           "kd-restart": "#2f6db3", "kd-backtrack": "#7fb2e5", "kd-push-down": "#1b3f73",
           "kd-short-stack": "#7a4fa3", "kd-stack": "#b08fd1", "kd-texture-stack": "#d16fae",
           "kd-ropes": "#b33a3a", "kd-ropes-packet": "#df8a6a", "kd-packet": "#4b2a70",
           "packets": "#7fb2e5", "+ push-down": "#7a4fa3", "+ short stack": "#4b2a70",
           "+ empty leaves skipped": "#b33a3a",
           EMBREE: "#8c8c8c", "bvh-threaded": "#3d8b57",
           "bvh-threaded kay-kajiya": "#3d8b57", "bvh-threaded goldsmith-salmon": "#8cc79d",
           "bvh-threaded octants": "#1d5c37", "bvh-stack": "#8cc79d", "bvh-packet": "#1d5c37",
           "bih": "#7a6a3a", "geometry-image": "#2a9d8f", "ray-engine": "#5a5a5a",
           "ray-tiles": "#3a4a5a", "ray-hierarchy": "#9aa7b5", "ray-classification": "#e0518a",
           "visibility-field": "#a8d05a"}


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


def save_chart(figure: Any, path: Path, footnote: str) -> None:
    """Write a chart with a footnote under it."""
    figure.text(0.01, 0.005, footnote, fontsize=7, color="#444444", va="bottom", wrap=True)
    with replacing(path) as temporary:
        figure.savefig(temporary, dpi=130, format="png")
    plt.close(figure)


__all__ = ["COLOURS", "markdown_table", "number", "plt", "save_chart", "write_csv", "write_text"]
