"""Between any two neighbouring frames of a film, about the same number of rays end.

This holds even if the last rays take very many passes.
"""
from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gpgpu_rt.inspect.film_frames import even_loss

LONG_TAIL = [4096] * 40 + [4096 - 50 * k for k in range(1, 80)] + [90] * 900 + [0]


def test_a_long_tail_takes_few_frames() -> None:
    chosen = even_loss(LONG_TAIL, 60)
    live = np.array(LONG_TAIL)[chosen]
    lost = -np.diff(live)
    assert chosen[0] == 0 and chosen[-1] == len(LONG_TAIL) - 1 and 40 < len(chosen) <= 60
    # Between two frames, about 1/59 of the rays end. Up to 50 more can end, because about 50 rays
    # end in the same pass.
    assert lost.min() >= 40 and lost.max() <= 4096 / 59 + 50
    # If frames were equally spaced in passes, most frames would show at most 90 live rays.
    assert (live <= 90).mean() < 0.05 < 0.8 < (np.array(LONG_TAIL) <= 90).mean()


@given(st.lists(st.integers(0, 5000), max_size=200), st.integers(2, 80))
def test_the_first_and_the_last_pass_are_frames(counts: list[int], frames: int) -> None:
    live = sorted(counts, reverse=True)
    chosen = even_loss(live, frames)
    assert len(chosen) <= frames and chosen == sorted(set(chosen))
    assert [chosen[0], chosen[-1]] == [0, len(live) - 1] if live else chosen == []
    # From a frame to the pass before the next frame, at most 1 / (frames - 1) of the rays end. The
    # last frame, which shows the last pass, is exempt.
    for one, other in zip(chosen, chosen[1:]):
        assert live[one] - live[other - 1] <= live[0] / (frames - 1) or other == len(live) - 1


@pytest.mark.parametrize("live", [[], [7], [7, 7], [0, 0, 0], [7, 7, 7, 7, 0]])
def test_short_traces_are_shown_in_full(live: list[int]) -> None:
    """All rays of brute force end in the same pass, but a film also shows the passes before."""
    assert even_loss(live, 5) == list(range(len(live)))
    assert even_loss([7, *live], 2) == ([0, len(live)] if live else [0])
