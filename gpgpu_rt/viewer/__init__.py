"""The viewer: a window, and a model of the scene and its pictures that needs no window."""
from __future__ import annotations

from .model import MODES, Viewer
from .selection import Selection

__all__ = ["MODES", "Selection", "Viewer"]
