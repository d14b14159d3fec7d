"""Scenes that are hard to sort or to split."""
from __future__ import annotations

import numpy as np
from conftest import random_soup


def mirrored(triangles: np.ndarray) -> np.ndarray:
    """Return triangles whose bounding boxes all have their centre at the origin."""
    box_lo, box_hi = triangles.min(1, keepdims=True), triangles.max(1, keepdims=True)
    size = box_hi - box_lo
    return np.concatenate([-size / 2, size / 2, size / 2 * np.float32([1, -1, 1])], axis=1)


FLAT = np.float32([1, 0, 1])
SCENES = {
    **{f"soup{seed}": (lambda seed=seed: random_soup(997, seed)) for seed in (1, 2, 3)},
    "rows": lambda: random_soup(4096 + 700, 4, size=0.01),
    "one": lambda: random_soup(1, 5), "two": lambda: random_soup(2, 6),
    "three": lambda: random_soup(3, 7), "five": lambda: random_soup(5, 8),
    "same": lambda: np.repeat(random_soup(1, 9), 300, axis=0),
    "pairs": lambda: np.repeat(random_soup(200, 10), 2, axis=0)[::-1],
    "clumps": lambda: np.repeat(random_soup(7, 11), 71, axis=0),
    "flat": lambda: random_soup(600, 12) * FLAT,
    "line": lambda: random_soup(600, 13) * np.float32([0, 1, 0]),
    "nested": lambda: random_soup(1, 14) * np.geomspace(1, 30, 80)[:, None, None].astype("f4"),
    "middles": lambda: mirrored(random_soup(90, 15)),
    "far": lambda: random_soup(400, 16) + np.float32([1e5, -3e4, 2e4]),
    "small": lambda: random_soup(300, 17) * np.float32(1e-12),
    "large": lambda: random_soup(300, 18) * np.float32(1e12),
    "huge": lambda: random_soup(300, 19) * np.float32(1e37),
    "uneven": lambda: np.concatenate([random_soup(500, 20) * np.float32(1e-4),
                                      random_soup(3, 21) * np.float32(50)]),
}
