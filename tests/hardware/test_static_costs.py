"""Stored costs of era kernels (docs/era.md): each present kernel text has its costs, and the costs
agree with the compilers' listings."""
from __future__ import annotations

import re
from pathlib import Path

import pytest

from gpgpu_rt.errors import OptionError
from gpgpu_rt.hardware.static_costs import (
    COMPILERS, all_era_programs, compiled_costs, digest_of, era_methods, era_programs, static_cost
)
from gpgpu_rt.options import ERA_TARGETS

NAMES = era_methods()
KERNELS = [(name, program.kernel) for name in NAMES for program in era_programs(name)]


@pytest.mark.parametrize("card", COMPILERS)
@pytest.mark.parametrize("method", NAMES)
def test_every_kernel_was_compiled_as_it_is_now(card: str, method: str) -> None:
    kept = compiled_costs(card).programs
    stale = [one.kernel for any_hit in (False, True) for one in era_programs(method, any_hit)
             if one.digest not in kept]
    assert not stale, (f"the text of {stale} of {method} has changed since it was compiled for "
                       f"{card}: run tools/static_costs.py --drivers FOLDER")


@pytest.mark.parametrize("card", COMPILERS)
def test_nothing_else_is_kept(card: str) -> None:
    assert set(compiled_costs(card).programs) == {one.digest for one in all_era_programs()}
    assert "Mesa" in compiled_costs(card).driver and compiled_costs(card).date > "2026"


@pytest.mark.parametrize("card", COMPILERS)
@pytest.mark.parametrize("method, kernel", KERNELS)
def test_counts_fit_together(card: str, method: str, kernel: str) -> None:
    cost = static_cost(card, method, kernel)
    assert (cost.method, cost.kernel, cost.refused) == (method, kernel, "")
    assert 1 <= cost.targets <= ERA_TARGETS and cost.registers > 0
    assert 1 <= cost.levels <= cost.fetches
    assert max(cost.vector, cost.scalar) <= cost.arithmetic or card == "r580"
    assert cost.arithmetic > 0 and (card == "g80") != bool(cost.listing)


@pytest.mark.parametrize("method, kernel", KERNELS)
def test_a_selection_takes_three_instructions_on_nv40(method: str, kernel: str) -> None:
    """The listing has one operation, CMP, for a selection. NV40 needs three instructions for a CMP:
    one sets the condition codes, and two move the two values."""
    cost = static_cost("nv40", method, kernel)
    operations = re.findall(r"^ *\d+: (\w+)", cost.listing, re.M)
    least = len(operations) - operations.count("END") + 2 * operations.count("CMP")
    # At most one operation in four needs one more instruction, which copies a constant.
    assert least <= cost.arithmetic + cost.fetches <= 1.25 * least


def test_a_triangle_test_reads_its_three_corners() -> None:
    for card in COMPILERS:
        # Two texels of the ray, one of the state, the hit, and three corners.
        assert static_cost(card, "brute-force", "intersect").fetches == 7


def test_a_comment_changes_no_digest() -> None:
    text = "a = 1;\n\n// comment\nb = 2;   // more\n"
    assert digest_of(text) == digest_of("a = 1;\nb  =  2;\n") != digest_of("a = 1;\nb = 3;\n")


def test_what_was_not_compiled_is_refused() -> None:
    with pytest.raises(OptionError, match="did you mean r420"):
        compiled_costs("r42")
    with pytest.raises(OptionError, match="no kernel 'dwn'; did you mean down"):
        static_cost("r420", "kd-restart", "dwn")
    with pytest.raises(OptionError, match="has no era form: "):
        era_programs("bvh-packet")


def test_the_page_has_these_counts() -> None:
    """Each row of docs/era.md gives a method, a kernel, and instructions + fetches by card."""
    page = (Path(__file__).parents[2] / "docs" / "era.md").read_text()
    rows = re.findall(r"^\| `([\w-]+)` \| `(\w+)` \| (.*) \|$", page, re.M)
    assert {(method, kernel) for method, kernel, _ in rows} >= {
        (method, kernel) for method, kernel in KERNELS
        if kernel != "init"}
    for method, kernel, cells in rows:
        costs = [static_cost(card, method, kernel) for card in ("r420", "r580", "nv40", "g80")]
        assert cells.split(" | ") == [f"{one.arithmetic} + {one.fetches}" for one in costs]


def test_the_page_has_the_counts_of_loops() -> None:
    page = (Path(__file__).parents[2] / "docs" / "era.md").read_text()
    counts = re.search(r"then takes (\d+), (\d+) and (\d+) instructions .* `traverse` of "
                       r"`bvh-threaded` (\d+), (\d+)\s+and (\d+)\.", page, re.S)
    assert counts is not None
    assert [int(count) for count in counts.groups()] == [
        static_cost(card, method, kernel, in_loop=True).arithmetic
        for method, kernel in (("kd-restart", "down"), ("bvh-threaded", "traverse"))
        for card in ("r580", "nv40", "g80")]


@pytest.mark.parametrize("card", ("r580", "nv40", "g80"))
@pytest.mark.parametrize("method, kernel", KERNELS)
def test_a_kernel_in_a_loop_asks_less(card: str, method: str, kernel: str) -> None:
    """A kernel in a loop does not test whether its ray waits for this kernel. The kernel in a loop
    therefore has at most as many instructions as the kernel of a pass."""
    alone, looped = (static_cost(card, method, kernel, in_loop=loop) for loop in (False, True))
    assert (looped.arithmetic < alone.arithmetic) == (kernel != "init")
    assert looped.arithmetic <= alone.arithmetic
