"""Geometry image: a surface as images of positions (Gu, Gortler and Hoppe, SIGGRAPH 2002)."""
from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...accel.image_cells import cell_faces
from ...disk.arrays import read_npz
from ...disk.files import replacing
from ...errors import SceneError
from ..scene import Scene


@dataclass(frozen=True, eq=False)
class GeometryImage:
    """A surface as charts. A chart is an image of positions, in which 2 x 2 neighbouring texels
    form a cell of two triangles.

    Two charts meet without a gap if their borders hold the same positions. The corners of the cell
    (i, j) are the texels a = (i, j), b = (i, j + 1), c = (i + 1, j + 1) and d = (i + 1, j). The
    cell's triangles are a b c and a c d. Faces are ordered by chart, row and column.

    Parameters
    ----------
    charts : (rows, columns, 3) float each, world units, at least 2 x 2

    Raises
    ------
    SceneError
        a chart has a wrong shape or is not finite in float32; the message names the chart
    """

    charts: tuple[np.ndarray, ...]

    def __init__(self, charts: Sequence[Any] | np.ndarray) -> None:
        checked = []
        for k, chart in enumerate(charts):
            try:
                with np.errstate(over="ignore"):
                    chart = np.ascontiguousarray(chart, np.float32)
            except (TypeError, ValueError):
                raise SceneError(f"geometry image: chart {k} is not an array of numbers; give "
                                 "(rows, columns, 3)") from None
            if chart.ndim != 3 or chart.shape[2] != 3 or min(chart.shape[:2]) < 2:
                raise SceneError(f"geometry image: chart {k} has shape {chart.shape}; give (rows, "
                                 "columns, 3), at least 2 rows and 2 columns, in a list of charts")
            if not np.isfinite(chart).all():
                raise SceneError(f"geometry image: chart {k} has a position that is not finite in "
                                 "float32; repair or rescale it")
            checked.append(chart)
        object.__setattr__(self, "charts", tuple(checked))

    @property
    def shapes(self) -> tuple[tuple[int, int], ...]:
        """(rows, columns) of each chart."""
        return tuple((len(chart), chart.shape[1]) for chart in self.charts)

    @property
    def positions(self) -> np.ndarray:
        """(texels, 3) float32, chart by chart, row by row."""
        return np.concatenate([np.zeros((0, 3), np.float32),
                               *(chart.reshape(-1, 3) for chart in self.charts)])

    @property
    def faces(self) -> np.ndarray:
        """(n, 3) int64, the texels of each triangle."""
        return cell_faces(self.shapes)

    def moved(self, positions: np.ndarray) -> GeometryImage:
        """Return charts of the same shapes with other positions, (texels, 3)."""
        ends = np.cumsum([rows * columns for rows, columns in self.shapes])
        parts = np.split(np.asarray(positions), ends[:-1])
        return GeometryImage([part.reshape(*shape, 3) for part, shape in zip(parts, self.shapes)])

    def normals(self) -> list[np.ndarray]:
        """Return the unit normals of each chart, (rows, columns, 3) float32. Texels at the same
        position, as on a seam or at a pole, have equal normals."""
        positions, faces = self.positions, self.faces
        places, place = np.unique(positions, axis=0, return_inverse=True)
        place = place.reshape(-1)
        v0, v1, v2 = places[place[faces]].astype(np.float64).transpose(1, 0, 2)
        weighted = np.cross(v1 - v0, v2 - v0)
        total = np.stack([np.bincount(place[faces].reshape(-1), np.repeat(weighted[:, axis], 3),
                                      len(places)) for axis in range(3)], axis=1)
        length = np.linalg.norm(total, axis=1, keepdims=True)
        unit = np.divide(total, length, out=np.zeros_like(total), where=length > 0)[place]
        return list(self.moved(unit).charts)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the charts to an .npz file at ``path``, which `load_scene` and `load` read."""
        with replacing(path) as temporary, temporary.open("wb") as file:
            np.savez_compressed(file, **{f"chart_{k}": c for k, c in enumerate(self.charts)})

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> GeometryImage:
        """Return the geometry image of the .npz file ``path`` with arrays chart_0, chart_1, ...

        Raises
        ------
        SceneError
            the file cannot be read, or holds no charts
        """
        found = read_npz(path, "a geometry image", SceneError)
        charts = [found[f"chart_{k}"] for k in range(len(found)) if f"chart_{k}" in found]
        if not charts:
            raise SceneError(f"{path}: holds no chart_0; a geometry image is an .npz with arrays "
                             "chart_0, chart_1, ..., (rows, columns, 3) each")
        return cls(charts)

    def scene(self, **settings: Any) -> Scene:
        """Return a scene of the triangles. The method `geometry-image` traces the charts; every
        other method traces the triangles.

        Parameters
        ----------
        settings : name, colours, light, camera and source, as in `Scene.from_arrays`
        """
        made = Scene.from_arrays(self.positions, self.faces, **{"name": "geometry image",
                                                                **settings})
        return replace(made, charts=self.shapes)
