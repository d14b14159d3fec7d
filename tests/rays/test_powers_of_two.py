"""Powers of two: exponents and scaled values equal those of numpy's frexp and ldexp to the bit."""
from __future__ import annotations

import numpy as np
import pytest

from gpgpu_rt.numerics.powers_of_two import exponents_of, scaled

# Ranges of exponents: ordinary values, all normal float32, and all float32 with denormals.
RANGES = {"ordinary": (-20, 20), "normal": (-125, 127), "denormal": (-148, 128)}


def _values(count: int, least: int, most: int, seed: int) -> np.ndarray:
    """Return (count,) positive float32, below 2^most."""
    rng = np.random.default_rng(seed)
    values = np.ldexp(rng.uniform(0.5, 1, count), rng.integers(least, most + 1, count))
    return np.minimum(values, np.finfo(np.float32).max).astype(np.float32)


@pytest.mark.parametrize("seed", [1, 2], ids="seed{}".format)
@pytest.mark.parametrize("values", RANGES)
def test_exponents_are_those_of_frexp(values: str, seed: int) -> None:
    sizes = _values(5000, *RANGES[values], seed)
    assert (exponents_of(sizes) == np.frexp(sizes)[1]).all()


def test_no_values_have_no_exponents() -> None:
    assert not len(exponents_of(np.empty(0, np.float32)))
    assert scaled(np.empty((0, 3), np.float32), np.empty(0, np.int32)).shape == (0, 3)


@pytest.mark.parametrize("seed", [3, 4], ids="seed{}".format)
@pytest.mark.parametrize("columns", [0, 3])
@pytest.mark.parametrize("values", RANGES)
@pytest.mark.parametrize("most", [126, 127, 150])
def test_values_are_scaled_as_by_ldexp(most: int, values: str, columns: int, seed: int) -> None:
    """Products overflow, are denormal and are rounded as those of ldexp."""
    rng = np.random.default_rng(seed)
    exponents = rng.integers(-most, most + 1, 5000).astype(np.int32)
    exponents[:2] = -most, most
    given = _values(5000 * max(columns, 1), *RANGES[values], seed)
    given *= rng.choice(np.float32([-1, 1]), len(given))
    given[::97], given[::101], given[::103] = 0, np.inf, np.nan
    if columns:
        given = given.reshape(-1, columns)
    with np.errstate(over="ignore"):
        expected = np.ldexp(given, exponents[:, None] if columns else exponents)
        found = scaled(given, exponents)
    assert found.dtype == np.float32
    assert np.array_equal(found.view(np.uint32) & 0x7fffffff, expected.view(np.uint32) & 0x7fffffff
                          ) and np.array_equal(np.signbit(found), np.signbit(expected))


def test_a_single_value_is_scaled_for_all_exponents() -> None:
    exponents = np.arange(-100, 100, dtype=np.int32)
    assert (scaled(np.float32([3]), exponents) == np.ldexp(np.float32(3), exponents)).all()
