"""Scaled: scales published rates to one card, as the survey scaled them for Figure 26.

The survey scaled each paper's rate "based on the bottleneck", to a GeForce 8800 and to 10,000
triangles. The figure shows neither the bottlenecks nor the original rates. Here each rate that the
survey prints elsewhere is scaled twice, by arithmetic and by bandwidth. The rate at 10,000
triangles is interpolated between two scenes (`at_triangles`).
"""
from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gpgpu_rt.hardware.cards import Card, find_card

from ..framework.published_numbers import (
    nanoseconds, published, published_row, published_triangles
)
from .on_cards import ON_CARDS
from .surveyed import BASE, CHIP

TRIANGLES = 10_000
# Source -> the figure with its rates, and that figure's method, options and kind of rays.
PRINTED = {
    "Foley and Sugerman 2005": ("fig12", "kd-restart", "", "primary"),
    "Thrane and Simonsen 2005": ("fig20", "bvh-threaded", "build=goldsmith-salmon", None),
    "Horn et al. 2007": ("fig13", "kd-packet", "push_down=True stack_size=3", "primary"),
    "Popov et al. 2007": ("fig16", "kd-ropes-packet", "", "primary"),
    "Günther et al. 2007": ("fig22", "bvh-packet", "", "primary"),
}
# The Ray Engine's method, scene, triangles and chip; its rate is in the survey's text.
ENGINE = ("ray-engine", "figure 5", 34_000, "NV25")


@dataclass(frozen=True)
class Scaled:
    """The rate of a paper's method on the paper's card: rays per second at 10,000 triangles, or at
    the nearest triangle count."""

    source: str
    card: Card
    rate: float
    scenes: tuple[str, ...]     # all scenes with a printed rate

    def on(self, card: Card) -> tuple[float, float]:
        """Return the rays per second on ``card``, scaled by arithmetic and by bandwidth."""
        return (self.rate * arithmetic(card) / arithmetic(self.card),
                self.rate * card.bandwidth / self.card.bandwidth)


def arithmetic(card: Card) -> float:
    """Return four-component instructions per second; four scalar instructions count as one."""
    return float(card.scalar_rate / 4 if card.scalar_units else card.vector_rate)


def at_triangles(points: list[tuple[int, float]], count: int = TRIANGLES) -> float:
    """Return the rate at ``count`` triangles, interpolated between points (triangles, rate).

    The interpolation is linear in the logarithms. If no scene is smaller, or no scene is larger,
    return the rate of the nearest scene.
    """
    x, y = zip(*sorted((math.log(n), math.log(rate)) for n, rate in points))
    return float(math.exp(np.interp(math.log(count), x, y)))


def scaled() -> list[Scaled]:
    """Return the rate and the card of every paper whose rates the survey prints."""
    method, scene, triangles, chip = ENGINE
    rate = published("text", scene, method, quantity="rate")
    assert rate is not None
    found = [Scaled(BASE, find_card(chip), rate, (f"{triangles:,} triangles",))]
    figures = {one.name: one for one in ON_CARDS}
    for source, (figure, method, options, rays) in PRINTED.items():
        points = {}
        paper = figures[figure].paper_card
        assert paper is not None
        for panel in figures[figure].panels:
            row = published_row(figure, panel.scene, method, options, rays)
            count, ns = published_triangles(figure, panel.scene), nanoseconds(row)
            if count is not None and ns is not None:
                points[panel.scene] = (count, 1e9 / ns)
        found.append(Scaled(source, paper.card, at_triangles(list(points.values())),
                            tuple(points)))
    return found


def speeds(rows: list[Scaled]) -> dict[str, tuple[float, float]]:
    """Return source -> speeds relative to the Ray Engine, by arithmetic and by bandwidth."""
    card = find_card(CHIP)
    base = next(row for row in rows if row.source == BASE).on(card)
    return {row.source: (row.on(card)[0] / base[0], row.on(card)[1] / base[1]) for row in rows}
