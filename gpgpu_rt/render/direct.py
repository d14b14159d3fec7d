"""Direct light with shadows; no ray goes on: what mirrors and glass send back is left out."""
from __future__ import annotations

from .whitted import Whitted


class Direct(Whitted):
    """Whitted's ray tracing without bounces; of a scene without mirrors and glass the same."""

    name = "direct"
    options = tuple(option for option in Whitted.options if option.name != "bounces")
