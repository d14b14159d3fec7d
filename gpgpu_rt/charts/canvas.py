"""Canvas: sets up matplotlib without a display, and saves charts."""
from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  (choose the backend first)

from ..disk.files import replacing  # noqa: E402
from ..inspect.data_uris import DESCRIPTION  # noqa: E402
from .palette import COLOURS  # noqa: E402

FORMATS = (".png", ".svg", ".pdf")
DPI = 130
plt.rcParams["axes.prop_cycle"] = plt.cycler(color=COLOURS)


def save(figure: Any, path: str | Path, shows: str) -> None:
    """Write a chart to a file, completely or not at all, and close the chart.

    Parameters
    ----------
    path : the file; its suffix is one of FORMATS
    shows : a sentence on what the chart shows, for readers who cannot see it. A PNG file holds
        this sentence and the names of the panels, axes and series
    """
    kind = Path(path).suffix[1:].lower()
    more = {"metadata": {DESCRIPTION: described(figure, shows)}} if kind == "png" else {}
    with replacing(path) as temporary:
        figure.savefig(temporary, dpi=DPI, format=kind, **more)
    plt.close(figure)


def described(figure: Any, shows: str) -> str:
    """Return ``shows``, then the names of the chart's panels, axes and series."""
    axes = [axis for axis in figure.axes if axis.get_visible()]
    legends = [*figure.legends, *(axis.get_legend() for axis in axes)]
    found = {
        "Panels": [axis.get_title(where) for axis in axes for where in ("left", "center")],
        "Axes": [label for axis in axes if axis.axison
                 for label in (axis.get_xlabel(), axis.get_ylabel())],
        "Series": [text.get_text() for legend in legends if legend is not None
                   for text in legend.get_texts()]}
    parts = [shows.strip().rstrip(".")]
    for head, names in found.items():
        names = list(dict.fromkeys(" ".join(name.split()) for name in names if name.strip()))
        if names:
            parts.append(f"{head}: {'; '.join(names)}")
    return ". ".join(parts) + "."
