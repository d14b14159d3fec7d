"""On cards: lists the survey's figures whose papers measured on a graphics card."""
from __future__ import annotations

from . import (
    fig12_eye_rays, fig13_horn_improvements, fig16_ropes_and_packets, fig20_whole_images,
    fig22_large_scenes
)

ON_CARDS = tuple(module.FIGURE for module in (
    fig12_eye_rays, fig13_horn_improvements, fig16_ropes_and_packets, fig20_whole_images,
    fig22_large_scenes))
