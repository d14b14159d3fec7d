"""Press: holds the state of a pressed mouse button."""
from __future__ import annotations

from dataclasses import dataclass


@dataclass
class Press:
    """A pressed mouse button, and the movement of the mouse since the press.

    Attributes
    ----------
    x, y : position of the press in the window
    button : number of the button
    dx, dy : movement since the last frame
    moved : length of the whole movement, from the press to the last frame
    released : whether the button was released
    over_panel : whether the press was over a panel; None while this is unknown
    """

    x: int
    y: int
    button: int
    dx: int = 0
    dy: int = 0
    moved: int = 0
    released: bool = False
    over_panel: bool | None = None
