"""Image light: samples directions in proportion to the luminance of a surrounding image.

The image is filtered bilinearly: radiance is a bilinear function in each cell between four texel
centres. Within a row of cells, the density of samples is proportional to the luminance of this
function. The first random number chooses a row, and the second number chooses a cell of the row.
Each number lies between two cumulative probabilities, and its place between them gives a
coordinate in the cell. A cell's probability is proportional to its luminance times its solid
angle. The density of a direction therefore depends only on the direction's radiance and latitude.

Pharr and Humphreys ("Infinite Area Light Source with Importance Sampling", 2004) choose a texel
instead. But bilinear filtering spreads a small sun to neighbouring texels, which their method
samples too rarely. ``glsl/render/image_light.glsl`` contains the same method as this module.
"""
from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .luminance import luminance


@dataclass(frozen=True, eq=False)
class ImageLight:
    """The sampling table of an equirectangular image, made by ``of``.

    Cells lie between texel centres. Row 0 of the cells lies above the centres of the first row of
    texels, and row ``height`` below the centres of the last row. These two rows are half as high
    as other rows, and their radiance does not vary with latitude. Column 0 lies between the last
    and the first column of texels.

    Attributes
    ----------
    texels : (height, width, 3) float64, the image
    rows : (height + 1,) float32, cumulative probability of the rows of cells
    cells : (height + 1, width) float32, cumulative probability of the cells within each row
    cosine : (height + 1,) float32, mean cosine of the latitude in each row
    power : luminance, integrated over all directions
    """

    texels: np.ndarray = field(repr=False)
    rows: np.ndarray = field(repr=False)
    cells: np.ndarray = field(repr=False)
    cosine: np.ndarray = field(repr=False)
    power: float

    @classmethod
    def of(cls, texels: np.ndarray) -> ImageLight | None:
        """Return the image light of (height, width, 3) texels, row 0 at the top; None if all are
        black."""
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
        """Return (n,) int64, the row of cells of each of (n, 3) unit directions."""
        height = len(self.texels)
        down = 0.5 - np.arcsin(np.clip(directions[:, 1], -1, 1)) / np.pi
        return np.clip(np.floor(down * height + 0.5).astype(np.int64), 0, height)

    def density(self, directions: np.ndarray, radiance: np.ndarray) -> np.ndarray:
        """Return the probability density per steradian, (n,), of (n, 3) unit directions with
        (n, 3) ``radiance``."""
        across = np.maximum(np.hypot(directions[:, 0], directions[:, 2]), 1e-30)
        return luminance(radiance) * self.cosine[self.row(directions)] / (self.power * across)

    def draw(self, random: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return sampled unit directions and their radiance, (n, 3) each, for (n, 2) random
        numbers in (0, 1)."""
        height, width = self.texels.shape[:2]
        row = np.searchsorted(self.rows, random[:, 0], side="right")
        # Add each row's number to the row's sums. The sums of all rows then ascend, so that a
        # single search finds the cells of all samples.
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
    """Return the position, (n,) in [0, 1), of each random number between two consecutive sums."""
    below = np.where(first, 0, sums[entry - 1]).astype(np.float64)
    return (random - below) / (sums[entry] - below)


def _linear(here: np.ndarray, there: np.ndarray, random: np.ndarray) -> np.ndarray:
    """Return (n,) samples in [0, 1] whose density is linear from ``here`` to ``there``."""
    root = np.sqrt(here ** 2 + random * (there ** 2 - here ** 2))
    return random * (here + there) / np.maximum(here + root, 1e-30)
