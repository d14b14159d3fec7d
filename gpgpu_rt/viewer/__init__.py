"""The viewer: a model of what is looked at, which knows nothing of windows, and a window on it."""
from __future__ import annotations

from .choices import Choices
from .model import MODES, Viewer

__all__ = ["Choices", "MODES", "Viewer"]
