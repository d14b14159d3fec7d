"""Film frames: chooses the passes that a film shows, with similar progress between frames."""
from __future__ import annotations

from collections.abc import Sequence


class EvenLoss:
    """Chooses passes by their live rays, one pass after another.

    Most rays of a trace end within few passes, and most passes run only for the few other rays.
    Therefore a frame is due each time that a further 1 / (frames - 1) of the first pass's live
    rays has ended.

    Parameters
    ----------
    frames : the largest number of chosen passes
    """

    def __init__(self, frames: int) -> None:
        self.frames = max(2, frames)
        self._first: int | None = None
        self._due = 0       # number of the next frame

    def takes(self, live: int) -> bool:
        """Return whether the next pass is a frame, given its number of live rays."""
        if self._first is None:
            self._first = live
        # The last frame is due at 0 live rays. `_due` never decreases, although live rays may
        # increase.
        lost = self._first - live
        reached = (lost * (self.frames - 1)) // max(self._first, 1)
        if self._due and reached < self._due:
            return False
        self._due = max(reached, 0) + 1
        return True

    def is_replaced(self, count: int, live: int, at_end: int) -> bool:
        """Return whether the trace's last pass replaces the last chosen pass.

        This is so if all frames are used, or if the two passes have equally many live rays.
        Otherwise the last pass becomes a further frame.

        Parameters
        ----------
        count : the number of chosen passes
        live, at_end : the live rays of the last chosen pass, and of the last pass
        """
        return count >= self.frames or count > 1 and live == at_end


def even_loss(live: Sequence[int], frames: int) -> list[int]:
    """Return the indices of at most ``frames`` passes with an even loss of live rays between them.

    The first and the last pass are chosen. If there are at most ``frames`` passes, all are chosen.

    Parameters
    ----------
    live : the live rays of each pass
    """
    if len(live) <= frames:
        return list(range(len(live)))
    chooser = EvenLoss(frames)
    chosen = [at for at, count in enumerate(live) if chooser.takes(count)]
    last = len(live) - 1
    if chosen and chosen[-1] != last:
        if chooser.is_replaced(len(chosen), live[chosen[-1]], live[last]):
            chosen.pop()
        chosen.append(last)
    return chosen
