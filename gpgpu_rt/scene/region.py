"""Region: the part of a picture that is drawn; its pixels equal those of the whole picture."""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..errors import OptionError
from .camera import image_size

Pixels = tuple[int, int]


@dataclass(frozen=True)
class Region:
    """A rectangle of pixels of a picture, or the whole picture.

    Attributes
    ----------
    whole : (width, height) of the picture
    corner : (x, y) of the region's top left pixel, counted from the picture's top left
    size : (width, height) of the region
    """

    whole: Pixels
    corner: Pixels
    size: Pixels

    @classmethod
    def of(cls, size: Sequence[int], region: Sequence[int] | None) -> Region:
        """Return the region for ``size`` and ``region`` of ``Tracer.render``, by default the whole
        picture.

        Raises
        ------
        OptionError
            the size is not valid, or the region does not lie inside the picture
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
            raise OptionError(f"region {(x, y, width, height)} is not inside a picture of "
                              f"{whole[0]} x {whole[1]} pixels")
        return cls(whole, (x, y), (width, height))

    @property
    def is_whole(self) -> bool:
        """Whether the region is the whole picture."""
        return self.size == self.whole

    @property
    def box(self) -> tuple[int, int, int, int]:
        """(x, y, width, height), the form that ``of`` accepts."""
        return *self.corner, *self.size

    def tiles(self, side: int) -> list[Region]:
        """Return tiles of side x side pixels that cover the region, row by row; smaller at the
        right and bottom edges."""
        (left, top), (width, height) = self.corner, self.size
        return [Region(self.whole, (x, y), (min(side, left + width - x),
                                            min(side, top + height - y)))
                for y in range(top, top + height, side) for x in range(left, left + width, side)]
