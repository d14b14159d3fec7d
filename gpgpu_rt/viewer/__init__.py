"""The viewer: a window, and a windowless model of the scene and its pictures."""
from __future__ import annotations

from .model import MODES, Viewer
from .selection import Selection

__all__ = ["MODES", "Selection", "Viewer"]
