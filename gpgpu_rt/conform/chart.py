"""Chart: draws each engine's share of wrong rays in each family of cases. Needs matplotlib."""
from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..charts import FORMATS, plt, save
from .suite import Row

__all__ = ["FORMATS", "draw"]

LEAST = 1e-4    # smaller shares get this share's colour


def draw(rows: Sequence[Row], path: str) -> None:
    """Write a chart to the file ``path``: a row per family, a column per engine."""
    engines = list(dict.fromkeys(row.engine for row in rows))
    families = list(dict.fromkeys(row.family for row in rows))
    shares = np.full((len(families), len(engines)), np.nan)
    figure, axis = plt.subplots(figsize=(3.2 + 0.75 * len(engines), 1.9 + 0.19 * len(families)))
    for row in rows:
        at = families.index(row.family), engines.index(row.engine)
        if row.rays:
            shares[at] = row.wrong_rays / row.rays
        words = "-" if not row.rays else str(row.wrong_rays or "")
        dark = row.rays and row.wrong_rays > 0.03 * row.rays
        axis.text(at[1], at[0], words, ha="center", va="center", fontsize=6,
                  color="white" if dark else "#444444")
    shown = np.where(shares == 0, np.log10(LEAST), np.log10(np.maximum(shares, LEAST)))
    image = axis.imshow(shown, cmap="Reds", vmin=np.log10(LEAST), vmax=0, aspect="auto")
    axis.set_yticks(range(len(families)), families, fontsize=7)
    axis.set_xticks(range(len(engines)), engines, fontsize=7, rotation=40, ha="left")
    axis.xaxis.tick_top()
    axis.tick_params(length=0)
    axis.spines[:].set_visible(False)
    bar = figure.colorbar(image, ax=axis, ticks=range(-4, 1), shrink=0.5)
    bar.ax.set_yticklabels(["none", "0.1 %", "1 %", "10 %", "all"], fontsize=7)
    figure.tight_layout()
    save(figure, path, "A map with a row for each family of difficult rays and a column for "
         "each ray tracer; a field has the number of wrong rays, and is dark if many rays are "
         "wrong")
