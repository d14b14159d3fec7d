"""The survey's own way to Figure 26, gone again: published rates, scaled to one card.

The survey scaled each paper's rate "based on the bottleneck", to a GeForce 8800, and for 10,000
triangles; neither the bottlenecks nor the numbers it began with are printed. Here each rate that
it does print is scaled by both, arithmetic and bandwidth, and between two scenes the rate at
10,000 triangles is taken from a straight line through the logarithms.
"""
from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gpgpu_rt.hardware.cards import Card, find_card

from ..experiments.period import EXPERIMENTS
from ..framework.published_numbers import (
    nanoseconds, published, published_row, published_triangles
)
from .surveyed import BASE

CHIP, TRIANGLES = "G80", 10_000
# Source -> figure, its method and options there, and what its rays are called.
PRINTED = {
    "Foley and Sugerman 2005": ("fig12", "kd-restart", "", "primary"),
    "Thrane and Simonsen 2005": ("fig20", "bvh-threaded", "build=goldsmith-salmon", None),
    "Horn et al. 2007": ("fig13", "kd-packet", "push_down=True stack_size=3", "primary"),
    "Popov et al. 2007": ("fig16", "kd-ropes-packet", "", "primary"),
    "Günther et al. 2007": ("fig22", "bvh-packet", "", "primary"),
}
ENGINE = ("ray-engine", "figure 5", 34_000, "NV25")   # its rate is in the text


@dataclass(frozen=True)
class Scaled:
    """A source's rate: rays a second at 10,000 triangles on its card, and as scaled."""

    source: str
    card: Card
    rate: float
    scenes: tuple[str, ...]     # that it is taken from

    def on(self, card: Card) -> tuple[float, float]:
        """Rays a second there, by the ratio of arithmetic and by that of bandwidth."""
        return (self.rate * arithmetic(card) / arithmetic(self.card),
                self.rate * card.bandwidth / self.card.bandwidth)


def arithmetic(card: Card) -> float:
    """Instructions a second on four components, or as many on one."""
    return float(card.scalar_rate / 4 if card.scalar_units else card.vector_rate)


def at_triangles(points: list[tuple[int, float]], count: int = TRIANGLES) -> float:
    """The rate at a number of triangles, from (triangles, rate); outside them that of the nearest.

    Rates of scenes with equally many triangles or nearly so are averaged by what lies around
    them: the line goes through the nearest scene on either side.
    """
    x, y = zip(*sorted((math.log(n), math.log(rate)) for n, rate in points))
    return float(math.exp(np.interp(math.log(count), x, y)))


def scaled() -> list[Scaled]:
    """Every source of whose method the survey prints a rate, with its card."""
    method, scene, triangles, chip = ENGINE
    rate = published("text", scene, method, quantity="rate")
    assert rate is not None
    found = [Scaled(BASE, find_card(chip), rate, (f"{triangles:,} triangles",))]
    chips = {one.figure.name: one.card for one in EXPERIMENTS}
    for source, (figure, method, options, rays) in PRINTED.items():
        points = {}
        for panel in next(one for one in EXPERIMENTS if one.figure.name == figure).figure.panels:
            row = published_row(figure, panel.scene, method, options, rays)
            count, ns = published_triangles(figure, panel.scene), nanoseconds(row)
            if count is not None and ns is not None:
                points[panel.scene] = (count, 1e9 / ns)
        found.append(Scaled(source, chips[figure], at_triangles(list(points.values())),
                            tuple(points)))
    return found


def speeds(rows: list[Scaled]) -> dict[str, tuple[float, float]]:
    """Source -> how many times the Ray Engine's rate, by arithmetic and by bandwidth."""
    card = find_card(CHIP)
    base = next(row for row in rows if row.source == BASE).on(card)
    return {row.source: (row.on(card)[0] / base[0], row.on(card)[1] / base[1]) for row in rows}
