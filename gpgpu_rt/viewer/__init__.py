"""The viewer: a model of the scene and its pictures, independent of any window, and a window."""
from __future__ import annotations

from .model import MODES, Viewer
from .selection import Selection

__all__ = ["MODES", "Selection", "Viewer"]
