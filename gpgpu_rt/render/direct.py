"""Direct: direct light with shadows, without reflections and refractions."""
from __future__ import annotations

from .whitted import Whitted


class Direct(Whitted):
    """Whitted's ray tracing without bounces. Scenes without mirrors and glass look the same as in
    `Whitted`."""

    name = "direct"
    options = tuple(option for option in Whitted.options if option.name != "bounces")
