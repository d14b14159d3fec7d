"""Low-discrepancy numbers: GLSL and numpy draw the same bits. The numbers of a pixel form nets, in
which every box of a given volume holds the same number of points.

Pixels and path vertices have independent numbers. Means converge faster than with random numbers.
"""
from __future__ import annotations

import itertools

import numpy as np
import pytest
from probing import evaluate
from spread import box_counts, chi_square

from gpgpu_rt.reference.random_numbers import random_numbers
from gpgpu_rt.reference.sobol import sobol_bits, sobol_numbers


@pytest.mark.small
@pytest.mark.parametrize("seed", [1])
@pytest.mark.parametrize("block", [0, 1])
def test_glsl_draws_the_same_bits(seed: int, block: int) -> None:
    where = np.random.default_rng(seed).integers(0, 1 << 32, (8_000, 4), np.uint32)
    where[:4000] %= np.uint32([4096, 4096, 8192, 4096])
    where[:, 3] = 1 + where[:, 3] % 60          # the vertices of a path
    found = evaluate("sobol", f"result = sobol_bits(x.xy, x.z, x.w, {block}u, 9u);", where)
    for bounce in np.unique(where[:, 3]):
        some = where[:, 3] == bounce
        assert (found[some] == sobol_bits(*where[some, :3].T, int(bounce), block, 9)).all()


def test_numbers_are_cell_middles_and_wrong_counters_are_refused() -> None:
    numbers = sobol_numbers(np.arange(1000), 3, 7, 2, 1) * 2.0 ** 24
    assert (numbers % 2 == 1).all() and (np.float32(numbers) == numbers).all()
    for wrong in ((1 << 12, 0, 0), (3, 2, 0), (0, 1, 0), (1, 0, 1 << 16)):
        with pytest.raises(ValueError, match="bounce"):
            sobol_numbers(0, 0, 0, *wrong)


@pytest.mark.parametrize("first", [0, 1 << 12, 3 << 16])
@pytest.mark.parametrize("pixel", [(0, 0), (17, 5), (4000, 3000)], ids=str)
def test_pairs_are_nets(pixel: tuple[int, int], first: int) -> None:
    """Consider 2^k consecutive samples that begin at a multiple of 2^k. Every box that results
    from halving the unit square k times holds exactly one of the samples.

    This is true for numbers 0 and 1, which make discrete choices. In block 0, it is also true for
    numbers 2 and 3, which choose a position or direction. Each single number is stratified too.
    """
    for bounce, k in itertools.product((0, 1, 7), range(11)):
        samples = first + np.arange(1 << k)
        for block in (0, 1) if bounce else (0,):
            numbers = sobol_numbers(*pixel, samples, bounce, block)
            for a in range(k + 1):
                assert (box_counts(numbers[:, :2], (a, k - a)) == 1).all()
                if not block:
                    assert (box_counts(numbers[:, 2:], (a, k - a)) == 1).all()
            assert all((box_counts(numbers[:, [axis]], (k,)) == 1).all() for axis in range(4))


@pytest.mark.parametrize("bounce", [0, 2, 40])
def test_a_direction_and_the_light_behind_it_are_one_net(bounce: int) -> None:
    """A direction and the light sample at the next vertex form a (3, k, 4)-net: a box of volume
    8 / 2^k holds 8 of 2^k points."""
    samples = np.arange(1 << 10)
    place, light = (sobol_numbers(9, 4, samples, event, block)[:, 2:]
                    for event, block in ((bounce, 0), (bounce + 1, 1)))
    points = np.concatenate([place, light], axis=1)
    for halvings in itertools.product(range(8), repeat=4):
        if sum(halvings) == 7:
            assert (box_counts(points, halvings) == 8).all()


def streams() -> dict[str, np.ndarray]:
    """Return (n, 8) numbers for each stream: two groups of four numbers that must be independent.

    The groups differ in the pixel, the vertex of the path, the block, the seed or the sample.
    """
    count = np.arange(1 << 14)
    line, column = count >> 7, count & 127

    def of(bounce: int, block: int, sample: object = 5, seed: int = 0, right: int = 0
           ) -> np.ndarray:
        return sobol_numbers(column + right, line, sample, bounce, block, seed)

    samples = count % 64
    return {"pixels": np.concatenate([of(1, 0), of(1, 0, right=1)], axis=1),
            "events": np.concatenate([of(1, 0, samples), of(2, 0, samples)], axis=1),
            "picks": np.concatenate([of(2, 0, samples), of(2, 1, samples)], axis=1),
            "seeds": np.concatenate([of(1, 0, samples), of(1, 0, samples, 1)], axis=1),
            "samples": np.concatenate([of(1, 1, 6), of(1, 1, 1_000_003)], axis=1)}


@pytest.mark.parametrize("name", list(streams()))
def test_numbers_of_different_nets_are_independent(name: str) -> None:
    """Numbers of different pixels, path vertices, blocks, seeds or samples are independent."""
    numbers = streams()[name]
    for axis in range(8):
        assert chi_square(box_counts(numbers[:, [axis]], (7,))) < 5
    for a, b in itertools.product(range(4), range(4, 8)):
        assert abs(chi_square(box_counts(numbers[:, [a, b]], (4, 4)))) < 5
        assert abs(np.corrcoef(numbers[:, a], numbers[:, b])[0, 1]) < 5 / np.sqrt(len(numbers))


@pytest.mark.parametrize("seed", [3])
@pytest.mark.parametrize("kind", ["smooth", "edge"])
def test_means_converge_faster_than_random_ones(seed: int, kind: str) -> None:
    """Estimates of an integral over a direction and a light, in 64 pixels, are unbiased. The error
    is smaller than with random numbers."""
    pixel, sample = (a.ravel() for a in np.meshgrid(np.arange(64), np.arange(256)))

    def error(draw) -> np.ndarray:
        place, light = (draw(pixel, 0, sample, event, block, seed)[:, 2:]
                        for event, block in ((0, 0), (1, 1)))
        values = np.concatenate([place, light], axis=1)
        found = (np.prod(0.5 + values, axis=1) if kind == "smooth"
                 else 16.0 * ((values[:, :2].sum(axis=1) < 1) & (values[:, 2:].max(axis=1)
                                                                 < 0.5 ** 1.5)))
        return found.reshape(256, 64).mean(axis=0) - 1

    even, random = error(sobol_numbers), error(random_numbers)
    assert abs(even.mean()) < 4 * even.std() / 8
    assert np.sqrt((even ** 2).mean()) < {"smooth": 0.2, "edge": 0.6}[kind] * np.sqrt(
        (random ** 2).mean())
