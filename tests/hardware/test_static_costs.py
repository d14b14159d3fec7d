"""Stored costs of era kernels (docs/era.md): the current text of each kernel has costs, and the
costs agree with the compilers' listings."""
from __future__ import annotations

import re
from pathlib import Path

import pytest

from gpgpu_rt.errors import OptionError
from gpgpu_rt.hardware.cards import Needs, find_card
from gpgpu_rt.hardware.machine_model import stream_fetches
from gpgpu_rt.hardware.static_costs import (
    COMPILERS, PACKETS, all_era_programs, compiled_costs, digest_of, era_methods, era_programs,
    static_cost
)
from gpgpu_rt.options import ERA_TARGETS
from gpgpu_rt.traversal.era_packets import LOOP

NAMES = era_methods()
PAGE = Path(__file__).parents[2] / "docs" / "compiled-kernels.md"
KERNELS = [(name, program.kernel) for name in NAMES for program in era_programs(name)]


@pytest.mark.parametrize("card, method", [
    (card, method) for card in COMPILERS for method in era_methods(card)])
def test_every_kernel_was_compiled_as_it_is_now(card: str, method: str) -> None:
    kept = compiled_costs(card).programs
    stale = [one.kernel for any_hit in (False, True)
             for one in era_programs(method, any_hit, card=card) if one.digest not in kept]
    assert not stale, (f"the text of {stale} of {method} has changed since it was compiled for "
                       f"{card}: run tools/static_costs.py --drivers FOLDER")


@pytest.mark.parametrize("card", COMPILERS)
def test_no_other_program_has_costs(card: str) -> None:
    assert set(compiled_costs(card).programs) == {one.digest for one in all_era_programs()}
    assert "Mesa" in compiled_costs(card).driver and compiled_costs(card).date > "2026"


@pytest.mark.parametrize("card, method, kernel", [
    (card, method, kernel) for card in COMPILERS for method, kernel in KERNELS
    if method in era_methods(card)])
def test_counts_fit_together(card: str, method: str, kernel: str) -> None:
    cost = static_cost(card, method, kernel)
    assert (cost.method, cost.kernel, cost.refused) == (method, kernel, "")
    assert 1 <= cost.targets <= ERA_TARGETS and cost.registers > 0
    assert 1 <= cost.levels <= cost.fetches
    assert max(cost.vector, cost.scalar) <= cost.arithmetic or card == "r580"
    assert cost.arithmetic > 0 and (card == "g80") != bool(cost.listing)


@pytest.mark.parametrize("method, kernel", KERNELS)
def test_a_selection_takes_three_instructions_on_nv40(method: str, kernel: str) -> None:
    """The listing has one operation, CMP, for a selection. NV40 needs three instructions for a
    CMP: one sets the condition codes, and two move the two values."""
    cost = static_cost("nv40", method, kernel)
    operations = re.findall(r"^ *\d+: (\w+)", cost.listing, re.M)
    least = len(operations) - operations.count("END") + 2 * operations.count("CMP")
    # At most one operation in four needs one more instruction, which copies a constant.
    assert least <= cost.arithmetic + cost.fetches <= 1.25 * least


def test_a_triangle_test_reads_its_three_corners() -> None:
    for card in COMPILERS:
        # Seven texels: two of the ray, one of the state, one of the hit, and three corners.
        assert static_cost(card, "brute-force", "intersect").fetches == 7


def test_a_comment_changes_no_digest() -> None:
    text = "a = 1;\n\n// comment\nb = 2;   // more\n"
    assert digest_of(text) == digest_of("a = 1;\nb  =  2;\n") != digest_of("a = 1;\nb = 3;\n")


@pytest.mark.parametrize("method, options", PACKETS, ids=str)
def test_packets_were_compiled_in_loops(method: str, options: dict) -> None:
    """Every single kernel fits every card. Cards without branches refuse the whole loop."""
    for card in COMPILERS:
        for one in era_programs(method, in_loop=True, **options):
            cost = static_cost(card, method, one.kernel, in_loop=True, **options)
            if one.kernel == LOOP and card in ("r300", "r420"):
                assert "Looping not supported" in cost.refused
                continue
            assert not cost.refused and cost.registers > 0
            assert 1 <= cost.targets <= ERA_TARGETS and cost.levels <= cost.fetches
    card = find_card("R580")
    whole, *kernels = (static_cost("r580", method, name, in_loop=True, **options)
                       for name in (LOOP, "traverse", "intersect", "leave", "begin", "pop"))
    assert sum(one.arithmetic for one in kernels) < whole.arithmetic
    assert not card.refuses(Needs(whole.slots, whole.fetches, whole.levels, True, whole.targets))


def test_an_instruction_of_a_packet_works_on_four_rays() -> None:
    """A packet's kernel for four rays takes fewer instructions than the kernels of two single
    rays."""
    options = dict(PACKETS[0][1])
    for ray, packet in (("down", "traverse"), ("intersect", "intersect")):
        single = static_cost("r580", "kd-restart", ray, in_loop=True).arithmetic
        four = static_cost("r580", "kd-packet", packet, in_loop=True, **options).arithmetic
        assert four < 2 * single


def test_a_loop_of_packets_reads_only_tables() -> None:
    """A visit fetches a node. A test fetches a reference and a triangle of three texels."""
    options = dict(PACKETS[2][1])
    for kernel, texels in (("traverse", 1), ("intersect", 4), ("leave", 0), ("push", 0)):
        cost = static_cost("r580", "kd-packet", kernel, in_loop=True, **options)
        assert cost.fetches - stream_fetches("kd-packet", kernel, **options) == texels


def test_what_was_not_compiled_is_refused() -> None:
    with pytest.raises(OptionError, match="did you mean r420"):
        compiled_costs("r42")
    with pytest.raises(OptionError, match="no kernel 'dwn'; did you mean down"):
        static_cost("r420", "kd-restart", "dwn")
    with pytest.raises(OptionError, match="has no era form: "):
        era_programs("bvh-packet")
    with pytest.raises(OptionError, match="not compiled for r580 with these options"):
        static_cost("r580", "kd-packet", "traverse", in_loop=True, push_down=False,
                    skip_empty_leaves=False)


def test_the_page_has_these_counts() -> None:
    """Each row of docs/compiled-kernels.md gives a method, a kernel, and instructions + fetches
    for each of four cards."""
    page = PAGE.read_text()
    rows = re.findall(r"^\| `([\w-]+)` \| `(\w+)` \| (.*) \|$", page, re.M)
    assert {(method, kernel) for method, kernel, _ in rows} >= {
        (method, kernel) for method, kernel in KERNELS
        if kernel != "init"}
    for method, kernel, cells in rows:
        costs = [static_cost(card, method, kernel) if method in era_methods(card) else None
                 for card in ("r420", "r580", "nv40", "g80")]
        assert cells.split(" | ") == [f"{one.arithmetic} + {one.fetches}" if one else "-"
                                      for one in costs]


def test_the_page_has_the_counts_of_loops() -> None:
    page = " ".join(PAGE.read_text().split())
    counts = re.search(r"then takes (\d+), (\d+) and (\d+) instructions .* `traverse` of "
                       r"`bvh-threaded` takes (\d+), (\d+) and (\d+)\.", page)
    assert counts is not None
    assert [int(count) for count in counts.groups()] == [
        static_cost(card, method, kernel, in_loop=True).arithmetic
        for method, kernel in (("kd-restart", "down"), ("bvh-threaded", "traverse"))
        for card in ("r580", "nv40", "g80")]


def test_the_page_has_the_counts_of_packets() -> None:
    page = PAGE.read_text()
    page = page.partition("## Packets in a loop")[2]
    rows = re.findall(r"^\| `(\w+)` \| [^`|]+ \| (.*) \|$", page, re.M)
    names = [one.kernel for one in era_programs("kd-packet", in_loop=True, **PACKETS[2][1])]
    assert sorted(name for name, _ in rows) == sorted(names)
    for name, cells in rows:
        costs = [static_cost(card, "kd-packet", name, in_loop=True, **PACKETS[2][1])
                 for card in ("r580", "nv40", "g80")]
        assert cells.split(" | ") == [f"{one.arithmetic} + {one.fetches}" for one in costs]
    counts = re.search(r"On R580, `traverse` takes (\d+) instructions without the stack, and "
                       r"(\d+) instructions without .*?takes (\d+) registers",
                       " ".join(page.split()))
    assert counts is not None and list(map(int, counts.groups())) == [
        static_cost("r580", "kd-packet", "traverse", in_loop=True, **PACKETS[1][1]).arithmetic,
        static_cost("r580", "kd-packet", "traverse", in_loop=True, **PACKETS[0][1]).arithmetic,
        static_cost("r580", "kd-packet", LOOP, in_loop=True, **PACKETS[2][1]).registers]


@pytest.mark.parametrize("card", ("r580", "nv40", "g80"))
@pytest.mark.parametrize("method, kernel", KERNELS)
def test_a_kernel_in_a_loop_has_fewer_instructions(card: str, method: str, kernel: str) -> None:
    """A kernel in a loop does not test whether its ray waits for this kernel. So every kernel
    except `init` has fewer instructions in a loop than in its own pass."""
    alone, looped = (static_cost(card, method, kernel, in_loop=loop) for loop in (False, True))
    assert (looped.arithmetic < alone.arithmetic) == (kernel != "init")
    assert looped.arithmetic <= alone.arithmetic
