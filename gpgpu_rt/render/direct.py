"""Direct: direct light with shadows, without reflections and refractions."""
from __future__ import annotations

from .whitted import Whitted


class Direct(Whitted):
    """Whitted's ray tracing without bounces. If a scene has no mirrors and no glass, the picture
    is the same as the picture of `Whitted`."""

    name = "direct"
    options = tuple(option for option in Whitted.options if option.name != "bounces")
