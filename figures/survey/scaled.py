"""Scaled: published rates, scaled to one card, which repeats the survey's way to Figure 26.

The survey scaled each paper's rate "based on the bottleneck", to a GeForce 8800 and to 10,000
triangles. It prints neither the bottlenecks nor the numbers that it began with. Here each printed
rate is scaled by arithmetic and by bandwidth. Between two scenes, the rate at 10,000 triangles is
interpolated linearly in the logarithms.
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
# Source -> figure, method and options there, and the name of its rays.
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
    """A source's rate: rays per second at 10,000 triangles on its card."""

    source: str
    card: Card
    rate: float
    scenes: tuple[str, ...]     # from which the rate is interpolated

    def on(self, card: Card) -> tuple[float, float]:
        """Rays per second on ``card``, by the ratio of arithmetic and by that of bandwidth."""
        return (self.rate * arithmetic(card) / arithmetic(self.card),
                self.rate * card.bandwidth / self.card.bandwidth)


def arithmetic(card: Card) -> float:
    """Four-component instructions per second; four scalar instructions count as one."""
    return float(card.scalar_rate / 4 if card.scalar_units else card.vector_rate)


def at_triangles(points: list[tuple[int, float]], count: int = TRIANGLES) -> float:
    """The rate at ``count`` triangles, interpolated between points (triangles, rate).

    The interpolation is linear in the logarithms, between the nearest scene on either side.
    Outside of the points it returns the rate of the nearest point.
    """
    x, y = zip(*sorted((math.log(n), math.log(rate)) for n, rate in points))
    return float(math.exp(np.interp(math.log(count), x, y)))


def scaled() -> list[Scaled]:
    """Every source with a published rate of its method, and its card."""
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
    """Source -> its rate over the Ray Engine's, by arithmetic and by bandwidth."""
    card = find_card(CHIP)
    base = next(row for row in rows if row.source == BASE).on(card)
    return {row.source: (row.on(card)[0] / base[0], row.on(card)[1] / base[1]) for row in rows}
