"""The viewer: a model of what is looked at, which knows nothing of windows, and a window on it."""
from __future__ import annotations

from .model import MODES, Viewer
from .selection import Selection

__all__ = ["MODES", "Selection", "Viewer"]
