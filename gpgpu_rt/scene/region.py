"""Region: the rectangle of a picture that is drawn, to the bit as it is in the whole."""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..errors import OptionError
from .camera import image_size

Pixels = tuple[int, int]


@dataclass(frozen=True)
class Region:
    """Some pixels of a picture, or all.

    Attributes
    ----------
    whole : (width, height) of the picture
    corner : (x, y) of the first pixel that is drawn, from the top left
    size : (width, height) of what is drawn
    """

    whole: Pixels
    corner: Pixels
    size: Pixels

    @classmethod
    def of(cls, size: Sequence[int], region: Sequence[int] | None) -> Region:
        """What ``Tracer.render`` is asked for by these words: the whole where ``region`` is None.

        Raises
        ------
        OptionError
            a size that is none, or a region that is no part of it
        """
        whole = image_size(size)
        if region is None:
            return cls(whole, (0, 0), whole)
        try:
            x, y, width, height = map(int, region)
        except (TypeError, ValueError):
            raise OptionError(f"region is {region!r}; give (x, y, width, height) in pixels"
                              ) from None
        if min(x, y) < 0 or min(width, height) < 1 or (x + width > whole[0]
                                                       or y + height > whole[1]):
            raise OptionError(f"region {(x, y, width, height)} is no part of a picture of "
                              f"{whole[0]} x {whole[1]} pixels")
        return cls(whole, (x, y), (width, height))

    @property
    def is_whole(self) -> bool:
        """Whether nothing is left out."""
        return self.size == self.whole

    @property
    def box(self) -> tuple[int, int, int, int]:
        """(x, y, width, height), as ``of`` takes it."""
        return *self.corner, *self.size

    def tiles(self, side: int) -> list[Region]:
        """Squares of so many pixels that cover it, row by row, the last ones of what is left."""
        (left, top), (width, height) = self.corner, self.size
        return [Region(self.whole, (x, y), (min(side, left + width - x),
                                            min(side, top + height - y)))
                for y in range(top, top + height, side) for x in range(left, left + width, side)]
