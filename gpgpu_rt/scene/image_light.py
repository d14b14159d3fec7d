"""Image light: directions to an image that surrounds a scene, as likely as it is bright there.

Radiance between four texels' middles is bilinear, so light is drawn from just that: first a row of
such cells, then a cell of it, by sums of their luminance times the cosine of the row's latitude;
then a place in the cell by the luminance at its corners. How likely a direction is then follows
from its radiance and latitude alone. Picking a texel instead (Pharr and Humphreys, "Infinite Area
Light Source with Importance Sampling", 2004) leaves what its neighbours take of a small sun by
filtering to chance. The twin of ``glsl/render/image_light.glsl``.
"""
from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .luminance import luminance


@dataclass(frozen=True, eq=False)
class ImageLight:
    """How an equirectangular image lights; made by ``of``.

    Cells lie between middles of texels: row 0 above the first row of texels and row ``height``
    below the last one are half as high and even in latitude; column 0 is between the last and the
    first column of texels.

    Attributes
    ----------
    texels : (height, width, 3) float64, the image
    rows : (height + 1,) float32, probability of each row of cells and those above
    cells : (height + 1, width) float32, in its row, probability of a cell and those before
    cosine : (height + 1,) float32, mean of the latitude's cosine in a row
    power : luminance, summed over all directions
    """

    texels: np.ndarray = field(repr=False)
    rows: np.ndarray = field(repr=False)
    cells: np.ndarray = field(repr=False)
    cosine: np.ndarray = field(repr=False)
    power: float

    @classmethod
    def of(cls, texels: np.ndarray) -> ImageLight | None:
        """How (height, width, 3) texels, row 0 at the top, light; None where all are black."""
        height, width = texels.shape[:2]
        bright = luminance(texels)
        bright = bright + np.roll(bright, 1, axis=1)
        cells = (np.concatenate([bright[:1], bright]) + np.concatenate([bright, bright[-1:]])) / 4
        edges = np.clip(np.arange(height + 2) - 0.5, 0, height) * np.pi / height
        cosine = (-np.diff(np.cos(edges)) / np.diff(edges)).astype(np.float32)
        rows = cells.sum(axis=1) * np.diff(edges) * cosine
        if not rows.any():
            return None
        power = rows.sum() * 2 * np.pi / width
        sums = np.cumsum(cells, axis=1)
        sums /= np.where(sums[:, -1:] > 0, sums[:, -1:], 1)
        rows = np.cumsum(rows)
        return cls(texels.astype(np.float64), np.float32(rows / rows[-1]), np.float32(sums),
                   cosine, float(power))

    def row(self, directions: np.ndarray) -> np.ndarray:
        """(n,) row of cells of (n, 3) unit directions."""
        height = len(self.texels)
        down = 0.5 - np.arcsin(np.clip(directions[:, 1], -1, 1)) / np.pi
        return np.clip(np.floor(down * height + 0.5).astype(np.int64), 0, height)

    def density(self, directions: np.ndarray, radiance: np.ndarray) -> np.ndarray:
        """(n,) per steradian, of (n, 3) unit directions with the radiance from there, (n, 3)."""
        across = np.maximum(np.hypot(directions[:, 0], directions[:, 2]), 1e-30)
        return luminance(radiance) * self.cosine[self.row(directions)] / (self.power * across)

    def draw(self, random: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Unit directions and radiance from there, (n, 3) each, by (n, 2) numbers in (0, 1)."""
        height, width = self.texels.shape[:2]
        row = np.searchsorted(self.rows, random[:, 0], side="right")
        # All rows' sums, one after another, are one sequence that rises.
        ordered = (self.cells + np.arange(height + 1.0)[:, None]).ravel()
        at = np.searchsorted(ordered, random[:, 1] + row, side="right")
        column = at - row * width
        down = _rest(self.rows, row, row == 0, random[:, 0])
        along = _rest(self.cells.ravel(), at, column == 0, random[:, 1])
        upper, lower = self.texels[np.maximum(row - 1, 0)], self.texels[np.minimum(
            row, height - 1)]
        each = np.arange(len(row))
        upper, lower = (texels[each[:, None], np.stack([column - 1, column], 1)]
                        for texels in (upper, lower))
        top, bottom = luminance(upper), luminance(lower)
        down = _linear(top.sum(axis=1), bottom.sum(axis=1), down)
        sides = top + (bottom - top) * down[:, None]
        along = _linear(sides[:, 0], sides[:, 1], along)
        ends = upper + (lower - upper) * down[:, None, None]
        radiance = ends[:, 0] + (ends[:, 1] - ends[:, 0]) * along[:, None]
        first, last = np.maximum(row - 0.5, 0), np.minimum(row + 0.5, height)
        latitude = np.pi * (0.5 - (first + (last - first) * down) / height)
        longitude = 2 * np.pi * ((column - 0.5 + along) / width - 0.5)
        return np.stack([np.cos(latitude) * np.sin(longitude), np.sin(latitude),
                         -np.cos(latitude) * np.cos(longitude)], axis=1), radiance


def _rest(sums: np.ndarray, entry: np.ndarray, first: np.ndarray, random: np.ndarray
          ) -> np.ndarray:
    """Where in [0, 1) numbers lie within their entries."""
    below = np.where(first, 0, sums[entry - 1]).astype(np.float64)
    return (random - below) / (sums[entry] - below)


def _linear(here: np.ndarray, there: np.ndarray, random: np.ndarray) -> np.ndarray:
    """(n,) places in [0, 1], by densities that go from ``here`` to ``there`` in a line."""
    root = np.sqrt(here ** 2 + random * (there ** 2 - here ** 2))
    return random * (here + there) / np.maximum(here + root, 1e-30)
