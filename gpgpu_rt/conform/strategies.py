"""Strategies: give the suite's cases to tests with Hypothesis, in this or other projects.

    @given(gpgpu_rt.conform.strategies.cases())
    def test_my_tracer(case):
        rays = case.triangles, case.origins, case.directions
        verdicts = gpgpu_rt.reference.check(*rays, *my_tracer(*rays))
        assert not verdicts.wrong.any()
"""
from __future__ import annotations

from collections.abc import Sequence

from hypothesis import strategies as st

from .case import Case
from .families import FAMILIES, make_case
from .suite import family_names

# Families with large or slow scenes.
SLOW = ("long-way", "coincident", "coplanar", "one-centroid")


def families(names: Sequence[str] = ()) -> st.SearchStrategy[str]:
    """Return a strategy that draws one of ``names``, by default any but the slow families."""
    return st.sampled_from(family_names(names) if names
                           else [name for name in FAMILIES if name not in SLOW])


@st.composite
def cases(draw: st.DrawFn, names: Sequence[str] = (), most_rays: int = 64,
          intervals: bool = False) -> Case:
    """Return a strategy of cases.

    Parameters
    ----------
    names : the families to draw from; by default all but the slow families
    most_rays : the largest number of rays of a case
    intervals : whether rays keep their family's t_min and t_max, instead of 0 and infinity
    """
    case = make_case(draw(families(names)), draw(st.integers(1, most_rays)),
                     draw(st.integers(0, 2 ** 32 - 1)))
    if intervals:
        return case
    return Case(case.triangles, case.origins, case.directions, case.closed, case.options)


def single_rays(names: Sequence[str] = ()) -> st.SearchStrategy[Case]:
    """Return a strategy of cases with one ray, which Hypothesis can shrink well."""
    return cases(names, most_rays=1)
