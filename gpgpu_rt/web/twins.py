"""Twins: pages of a gallery, each of which goes with a figure of ``make figures``."""
from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Twin:
    """An interactive page that goes with a figure.

    Attributes
    ----------
    figure : the figure's name; the page has the same name
    scene : the scene of the page
    methods : the methods of the page
    shows : what a reader can see there, in a sentence
    """

    figure: str
    scene: str
    methods: tuple[str, ...]
    shows: str

    @property
    def file(self) -> str:
        return f"{self.figure}.html"


TWINS = (
    Twin("fig07", "soft-shadows", ("grid", "grid-proximity"),
         "Proximity clouds let a ray jump over empty cells."),
    Twin("fig08", "stadium", ("grid", "grid-proximity", "kd-restart", "bvh-threaded"),
         "The teapot lies in a few cells of the grid; the trees have small nodes at the teapot."),
    Twin("fig11", "cornell", ("kd-restart", "kd-backtrack"),
         "After a leaf, a ray restarts at the root, or climbs to a parent."),
    Twin("fig13", "cornell", ("kd-restart", "kd-push-down", "kd-short-stack"),
         "Push-down and a short stack avoid visits that a restart at the root repeats."),
    Twin("fig15", "cornell", ("kd-ropes", "kd-restart"),
         "Ropes lead a ray from a leaf to the next leaf."),
    Twin("fig19", "shirley6", ("bvh-threaded", "bih"),
         "Escape indices lead through a hierarchy of boxes without a stack."),
    Twin("fig20", "teapot", ("grid", "kd-restart", "bvh-threaded"),
         "A grid, a kd-tree and a threaded hierarchy trace the same rays."),
    Twin("fig21", "knot", ("geometry-image",),
         "The mesh is an image of positions. Pyramids over the image hold the mesh's boxes."),
)
