"""Page data: the tables and texts of a page, each stored once."""
from __future__ import annotations

from typing import Any

import moderngl
import numpy as np

from ..gl.es import es_text
from ..scene.scene import Scene
from .packing import packed_table


class NotInBrowser(Exception):
    """Says why a schedule does not run in a browser."""


class PageData:
    """The tables and texts of a page. Equal tables or texts are stored once."""

    def __init__(self) -> None:
        self.texts: list[str] = []
        self.tables: list[dict[str, Any]] = []
        self.triangles: dict[str, int] = {}
        self._corners = np.zeros((0, 3, 3), np.float32)
        self._known: dict[tuple[Any, ...], int] = {}

    def text(self, text: str) -> int:
        """Store a program's text in GLSL ES, and return its index in ``texts``."""
        told = es_text(text)
        if told not in self.texts:
            self.texts.append(told)
        return self.texts.index(told)

    def scene(self, scene: Scene) -> None:
        """Store the scene's triangles, from which the page makes triangle tables and surfaces.

        ``triangles`` then has the indices of three tables: the distinct corners, each triangle's
        three corner indices, and each triangle's colour (8 bits each of red, green and blue).
        """
        self._corners = np.ascontiguousarray(scene.triangles, np.float32)
        bits = self._corners.reshape(-1, 3).view("V12").ravel()
        _, first, place = np.unique(bits, return_index=True, return_inverse=True)
        # packing.py can predict many indices if corners are numbered in the order of first use.
        order = np.argsort(first)
        numbers = np.empty(len(order), np.int64)
        numbers[order] = np.arange(len(order))
        colours = np.round(255 * np.clip(scene.colours, 0, 1)).astype(np.int64)
        self.triangles = {
            "vertices": self.values(self._corners.reshape(-1, 3)[first[order]]),
            "corners": self.values(numbers[place].reshape(-1, 3).astype(np.float32)),
            "colours": self.values((colours @ (1, 256, 65536)).astype(np.float32))}

    def values(self, values: np.ndarray, **more: Any) -> int:
        """Store values, (n,) or (n, components) float32; return their index in ``tables``."""
        key = values.shape, values.tobytes(), *more.items()
        if key not in self._known:
            self._known[key] = len(self.tables)
            self.tables.append({**more, **packed_table(values)})
        return self._known[key]

    def texture(self, texture: moderngl.Texture) -> int:
        """Store the table that a texture holds, and return its index in ``tables``."""
        kind = {"f4": np.float32, "f2": np.float16}.get(texture.dtype)
        if kind is None:
            raise NotInBrowser("a table of the method does not hold floats")
        values = np.frombuffer(texture.read(), kind)
        texels = values.astype(np.float32).reshape(-1, texture.components)
        size = *texture.size, texture.components
        rows = self._triangle_rows(texels)
        return self.values(texels, size=size) if rows is None else self.values(
            rows, size=size, triangles=True)

    def _triangle_rows(self, texels: np.ndarray) -> np.ndarray | None:
        """Return each row's triangle, and whether it is the last of its leaf, (n, 2). Return None
        if a table made from these values would differ from ``texels`` in a bit."""
        if texels.shape[1] != 4 or not len(self._corners):
            return None
        rows = np.zeros((-(-len(texels) // 3), 3, 4), np.float32)
        rows.reshape(-1, 4)[:len(texels)] = texels
        count = int(np.flatnonzero(rows.any((1, 2)))[-1:].sum()) + 1
        found = rows[:count, :2, 3]
        index = np.clip(np.nan_to_num(found[:, 0]), 0, len(self._corners) - 1).astype(np.int64)
        made = np.zeros_like(rows)
        made[:count, :, :3] = self._corners[index]
        made[:count, :2, 3] = found
        return found if made.tobytes() == rows.tobytes() and (found[:, 0] == index).all() else None
