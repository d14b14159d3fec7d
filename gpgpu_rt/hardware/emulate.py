"""An emulated fragment processor: runs a compiled program and counts what it does, region by
region, at every width that fragments may be bound together in."""
from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..accel.morton import morton_2d
from .program import Program, Work
from .translate import translate

WIDTHS = (1, 2, 4, 8, 16, 32, 48, 64, 256, 1024)

Look = Callable[[str, np.ndarray, np.ndarray], None]


def unseen(sampler: str, at: np.ndarray, mask: np.ndarray) -> None:
    """Looks at no fetch."""


@dataclass
class Run:
    """What a program did.

    Attributes
    ----------
    fragments : how many ran it
    outputs : name -> (n, 4) float32
    runs : width -> (regions,) how many groups of so many fragments ran each region: a group runs
        what any of its fragments wants
    """

    program: Program
    fragments: int
    outputs: dict[str, np.ndarray]
    runs: dict[int, np.ndarray]

    def instructions(self, vector: bool = True, width: int = 1) -> float:
        """Instructions issued, times the lanes that each occupies."""
        costs = [w.vector if vector else w.scalar for w in self.program.work]
        return float(width * (self.runs[width] @ np.array(costs)))

    def predicated(self) -> Work:
        """The work of a machine that runs both sides of branches, but loops only as often as
        each fragment wants."""
        total = Work()
        for region in [0, *self.program.loops]:
            one, runs = self.program.flattened(region), int(self.runs[1][region])
            total = total + Work(runs * one.vector, runs * one.scalar, Counter(
                {name: runs * count for name, count in one.fetches.items()}))
        return total

    def fetches(self, width: int = 1) -> dict[str, float]:
        """Texel fetches by sampler, of lanes that wait as well where ``width`` is over 1."""
        total: Counter[str] = Counter()
        for runs, work in zip(self.runs[width], self.program.work):
            for name, count in work.fetches.items():
                total[name] += width * int(runs) * count
        return dict(total)


def emulate(program: Program, samplers: Mapping[str, np.ndarray], uniforms: Mapping[str, Any],
            texels: np.ndarray, widths: Sequence[int] = WIDTHS,
            look: Look = unseen) -> Run:
    """Run a program.

    Parameters
    ----------
    samplers : name -> (h, w, c) float32, or uint32
    uniforms : name -> value, as the pass was given
    texels : (n, 2) int, x and y of the fragments; neighbours in this order are bound together
    look : is told of every fetch: the sampler, the texels' places in it, row by row (one or one a
        fragment), and (n,) bool, which fragments want theirs
    """
    count = len(texels)
    flat = {}
    for name in program.samplers:
        texture = samplers[name]
        if texture.dtype == np.uint32:      # integers, as the words that they are
            texture = texture.view(np.float32)
        four = np.zeros((texture.shape[0] * texture.shape[1], 4), np.float32)
        four[:, :texture.shape[2]] = texture.reshape(len(four), -1)
        flat[name] = np.asfortranarray(four), texture.shape[1]
    given = {**uniforms, "gl_FbWposYTransform": (1.0, 0.0, 1.0, 0.0)}   # y as it is
    values = {at: np.ravel(given[name]) for at, (name, _) in program.uniforms.items()}
    out = {name: np.zeros((4, count), np.float32) for name in program.outputs}
    arrays = {name: np.zeros((length, count), np.int32 if kind == "int" else np.float32)
              for name, (kind, length) in program.arrays.items()}
    counts = {width: np.zeros(len(program.work), np.int64) for width in widths}
    groups = [_Groups(count, width) for width in widths]

    def region(number: int, mask: np.ndarray) -> None:
        for one in groups:
            counts[one.width][number] += one.wanted(mask)
    scope: dict[str, Any] = {"np": np, "ONE": np.float32(1), "HALF": np.float32(0.5),
                             "clip": _clip, "wide": _wide}
    exec(compile(translate(program), "<fragment program>", "exec"), scope)   # our own text
    with np.errstate(all="ignore"):
        scope["run"](flat, values, texels[:, 0], texels[:, 1], out, arrays, region, look)
    return Run(program, count, {name: np.ascontiguousarray(v.T) for name, v in out.items()},
               counts)


class _Groups:
    """So many of ``count`` fragments bound together, told apart by words of as many bytes."""

    def __init__(self, count: int, width: int) -> None:
        self.width = width
        bytes_ = next(b for b in (8, 4, 2, 1) if width % b == 0 and count % b == 0)
        self._word = np.dtype(f"u{bytes_}")
        self._starts = np.arange(0, count // bytes_, width // bytes_)
        self._whole = width == bytes_

    def wanted(self, mask: np.ndarray) -> int:
        """Groups with a fragment in the mask, (count,) bool."""
        words = mask.view(self._word)
        return int(np.count_nonzero(words if self._whole
                                    else np.bitwise_or.reduceat(words, self._starts)))


def _clip(places: Any, highest: int) -> Any:
    """From 0 to ``highest``; numpy's own asks each time what integers there are."""
    return np.minimum(np.maximum(places, 0), highest)


def _wide(value: Any, count: int) -> np.ndarray:
    """One for each fragment, where all have the same too."""
    return value if value.shape else np.broadcast_to(value, count)


def texels_along_morton(width: int, height: int) -> np.ndarray:
    """(width * height, 2) int: texels in an order whose runs are compact, as rasterisers go."""
    y, x = np.divmod(np.arange(width * height), width)
    return np.stack([x, y], axis=1)[np.argsort(morton_2d(y, x), kind="stable")]
