"""Random numbers: GLSL and numpy draw the same numbers, which are uniform and independent."""
from __future__ import annotations

import numpy as np
import pytest
from probing import evaluate
from spread import chi_square

from gpgpu_rt.reference.random_numbers import random_bits, random_numbers


def streams() -> dict[str, np.ndarray]:
    """Return the numbers of each stream, (n, 4).

    Along a stream, the pixel, sample, bounce, block or seed changes. A picture uses the numbers of
    a stream together, so the numbers must be independent.
    """
    count = np.arange(1 << 16)
    line, column = count >> 8, count & 255
    return {
        "pixels": random_numbers(column, line, 0, 1, 0),
        "samples": random_numbers(17, 5, count, 1, 0),
        "far pixels": random_numbers(column + 8000, line + 5000, 4095, 3, 1),
        "bounces": np.concatenate([random_numbers(column[:512], line[:512], 3, bounce, 0)
                                   for bounce in range(128)]),
        "blocks": np.concatenate([random_numbers(column[:8192], 0, line[:8192], 1, block)
                                  for block in range(8)]),
        "seeds": np.concatenate([random_numbers(column[:512], line[:512], 0, 1, 0, seed)
                                 for seed in range(128)]),
    }


@pytest.mark.small
@pytest.mark.parametrize("seed", [1])
def test_glsl_draws_the_same_bits(seed: int) -> None:
    counters = np.random.default_rng(seed).integers(0, 1 << 32, (20_000, 4), np.uint32)
    counters[:4096, :2] %= 4096
    counters[:4096, 2:] %= 64
    assert (evaluate("random", "result = random_bits(x);", counters)
            == random_bits(counters)).all()
    where = counters % np.uint32([4096, 4096, 5000, 4000])
    words = "random_numbers(random_counter(x.xy, x.z, x.w, 5u, 9u))"
    found = evaluate("random", f"result = floatBitsToUint({words});", where).view(np.float32)
    expected = np.concatenate([random_numbers(*where[where[:, 3] == bounce, :3].T, bounce, 5, 9)
                               for bounce in np.unique(where[:, 3])])
    order = np.argsort(where[:, 3], kind="stable")
    assert (found[order] == expected).all()
    assert found.min() > 0 and found.max() < 1


def test_numbers_are_cell_middles_and_wrong_counters_are_refused() -> None:
    numbers = random_numbers(np.arange(1000), 3, 7, 2, 1) * 2.0 ** 24
    assert (numbers % 2 == 1).all() and (np.float32(numbers) == numbers).all()
    for wrong in ((1 << 12, 0, 0), (0, 16, 0), (0, 0, 1 << 16)):
        with pytest.raises(ValueError, match="below"):
            random_numbers(0, 0, 0, *wrong)


def test_no_two_counters_share_their_numbers() -> None:
    """A counter holds pixel, sample, bounce and block. The hash maps different counters to
    different numbers."""
    x, y, sample, bounce = (a.ravel() for a in np.meshgrid(*(np.arange(16),) * 4))
    words = np.stack([x, y, sample, bounce << 4], axis=1).astype(np.uint32)
    assert len(np.unique(random_bits(words), axis=0)) == len(words)


@pytest.mark.parametrize("name", list(streams()))
def test_numbers_are_uniform_and_independent(name: str) -> None:
    """Each channel is tested alone, in pairs with other channels, and in pairs with later numbers.

    A chi-square test has 256 cells for a channel, or 16 x 16 cells for a pair. Pairs must also be
    uncorrelated, and the spectrum of a channel must have no peak.
    """
    numbers = streams()[name]
    n = len(numbers)
    pairs = []
    for a in range(4):
        assert abs(chi_square(np.bincount((256 * numbers[:, a]).astype(int), minlength=256))) < 5
        pairs += [(numbers[:, a], numbers[:, b]) for b in range(a)]
        for lag in (1, 2, 16, 256, 512):
            pairs += [(numbers[:-lag, a], numbers[lag:, b]) for b in range(4)]
        spectrum = np.abs(np.fft.rfft(numbers[:, a] - 0.5))[1:] ** 2 * 12 / n
        # The n / 2 values of the spectrum are exponentially distributed with mean 1. So the
        # largest value is about log(n / 2).
        assert spectrum.max() < np.log(n) + 10
    for first, second in pairs:
        cells = (16 * first).astype(int) * 16 + (16 * second).astype(int)
        assert abs(chi_square(np.bincount(cells, minlength=256))) < 5
        assert abs(np.corrcoef(first, second)[0, 1]) < 5 / np.sqrt(len(first))


def test_mean_over_samples_converges() -> None:
    """A sample's value is the product of 48 factors of mean 1, from two blocks of six bounces. The
    mean of the samples is 1 within its noise."""
    samples = np.arange(1 << 14)
    numbers = np.concatenate([random_numbers(3, 4, samples, bounce, block) for bounce in range(6)
                              for block in (0, 1)], axis=1)
    product = np.prod(1 + (numbers - 0.5), axis=1)
    assert abs(product.mean() - 1) < 4 * product.std() / np.sqrt(len(samples))
