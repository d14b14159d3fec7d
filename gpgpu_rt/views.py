"""Views: how an object shows itself, as a line of text and as a table in a notebook.

A view shows the object's facts: pairs of a name and a text. The time to make a view is bounded,
because a notebook shows each result without being asked.
"""
from __future__ import annotations

import base64
import html
import io
import math
import sys
from collections.abc import Iterable

import numpy as np
from PIL import Image

Facts = list[tuple[str, str]]

MOST_RAYS = 1 << 20     # a view of more rays reads at most this many of them, evenly spaced
SIDE = 192              # longest side of a thumbnail, in pixels
MISS, FAR, NEAR = 0, 60, 255    # grey levels of a depth picture
_TEXT = 'style="text-align:left"'


def line(name: str, facts: Iterable[tuple[str, str]]) -> str:
    """Return the facts in one line: ``Scene(bunny, 69,451 triangles)``."""
    return f"{name}({', '.join(' '.join(text.split()) for _, text in facts if text)})"


def table(name: str, facts: Iterable[tuple[str, str]], picture: Image.Image | None = None) -> str:
    """Return the facts as an HTML table with escaped texts, beside a picture if one is given."""
    rows = "".join(f"<tr><th {_TEXT}>{html.escape(fact)}</th>"
                   f"<td {_TEXT}>{html.escape(text)}</td></tr>" for fact, text in facts if text)
    found = f"<table><caption {_TEXT}><b>{html.escape(name)}</b></caption>{rows}</table>"
    if picture is None:
        return found
    file = io.BytesIO()
    picture.save(file, "PNG")
    content = base64.b64encode(file.getvalue()).decode()
    return (f'<div style="display:flex;gap:1em;align-items:flex-start">{found}'
            f'<img alt="" src="data:image/png;base64,{content}"></div>')


def in_notebook() -> bool:
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return getattr(shell, "kernel", None) is not None


def stride(count: int, most: int) -> int:
    """Return the smallest step that picks at most ``most`` of ``count`` items."""
    return max(1, math.ceil(count / most))


def depth_picture(t: np.ndarray) -> Image.Image:
    """Return a small grey picture of distances: near is bright, and a miss is black.

    Parameters
    ----------
    t : (h, w) float, distances; not finite at a miss
    """
    step = stride(max(t.shape), SIDE)
    t = t[::step, ::step].astype(np.float64)
    hit = np.isfinite(t)
    grey = np.full(t.shape, MISS, np.uint8)
    if hit.any():
        lo, hi = t[hit].min(), t[hit].max()
        share = (t[hit] - lo) / (hi - lo) if hi > lo else np.zeros(hit.sum())
        grey[hit] = np.round(NEAR + (FAR - NEAR) * share)
    return Image.fromarray(grey)


def spread(values: np.ndarray) -> str:
    """Return the smallest and the largest value, as in "1.2 to 3.4"."""
    return f"{values.min():.4g} to {values.max():.4g}"
