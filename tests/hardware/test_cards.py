"""The data of graphics cards (rates and limits), and times predicted from these data."""
from __future__ import annotations

import json
import math

import pytest

from gpgpu_rt.cli.main import main
from gpgpu_rt.errors import OptionError
from gpgpu_rt.hardware.cards import Needs, cards, find_card
from gpgpu_rt.hardware.model import Counted, kernel_work, loop_work, predict, share_of

CHIPS = ("R200", "NV25", "R420", "NV40", "R580", "G80")


def test_every_card_has_every_figure_with_its_source() -> None:
    assert tuple(card.chip for card in cards()) == CHIPS
    names = [set(card.figures) for card in cards()]
    assert all(one == names[0] for one in names)
    for card in cards():
        for figure in card.figures.values():
            assert set(figure) == {"value", "unit", "source", "read"} and figure["source"]


def test_recalled_figures_are_marked() -> None:
    for card in cards():
        for name, figure in card.figures.items():
            if figure["source"].startswith("from memory") and ":" not in figure["source"]:
                assert not figure["read"], (card.chip, name)


def test_limits_refuse_with_a_reason() -> None:
    needs = Needs(arithmetic=600, textures=20, dependent_reads=3, loops=True, targets=5)
    assert find_card("R200").refuses(needs)[0].says.startswith("needs float textures")
    assert [(one.limit, one.says) for one in find_card("R420").refuses(needs)] == [
        ("loops", "needs loops, the card has no branches"),
        ("targets", "needs 5 render targets, the card has 4")]
    assert find_card("G80").refuses(needs) == []
    with pytest.raises(OptionError, match="no card 'G8O'.*G80"):
        find_card("G8O")


def test_the_slower_of_arithmetic_and_memory_decides() -> None:
    card = find_card("R580")
    work = Counted(instructions=card.vector_rate, texels=card.texel_rate / 2,
                   streamed=card.bandwidth / 4, passes=2, pixels=card.pipes * card.clock / 20,
                   read_back=card.readback)
    found = predict(card, work, share=0.5)
    assert found.seconds == pytest.approx(1 / 0.5 + 0.1 + 1)
    assert found.bound == "arithmetic"
    slower = predict(card, Counted(texels=3 * card.texel_rate))
    assert (slower.seconds, slower.bound) == (pytest.approx(3), "texels")


def _region(vector: int, parent: int, loop: bool, runs: dict[int, int]) -> dict:
    return {"vector": vector, "scalar": 2 * vector, "fetches": {"kd_node_table": 1}, "loop": loop,
            "parent": parent, "runs": {str(width): count for width, count in runs.items()}}


def test_a_side_of_a_branch_is_skipped_where_that_spares_something() -> None:
    # The regions are a program that a group of 32 lanes runs, a loop of 10 iterations, a branch
    # side that no lane needs, and a branch side that few lanes need.
    work = {"fragments": 32, "written_bytes": 16, "texel_bytes": {}, "regions": [
        _region(10, -1, False, {1: 32, 32: 1}), _region(7, 0, True, {1: 200, 32: 10}),
        _region(40, 1, False, {1: 0, 32: 0}), _region(2, 1, False, {1: 5, 32: 3})]}
    card = find_card("G80")
    found, branch = loop_work(card, work), card.branch_cost
    skipped = 32 * 10 * branch  # a branch costs less than the side's 80 instructions
    taken = min(4 * 32 * 3 + 32 * 10 * branch, 4 * 32 * 10)
    assert found.instructions == 20 * 32 + 14 * 320 + skipped + taken
    assert found.texels == 32 + 200 + 5 and found.streamed == 32 * 16
    # A card without branches runs both sides, and its instructions have four components.
    both = loop_work(find_card("R420"), work, 32)
    assert both.instructions == 10 * 32 + 7 * 320 + (40 + 2) * 320


@pytest.mark.parametrize("chip", ["R420", "G80"])
def test_the_share_at_which_work_takes_so_long(chip: str) -> None:
    card = find_card(chip)
    work = Counted(instructions=1e9, texels=1e7, streamed=1e8, passes=40, pixels=512 ** 2)
    for share in (0.1, 0.4, 1.0):
        assert share_of(card, work, predict(card, work, share).seconds) == pytest.approx(share)
    over = predict(card, work).parts
    assert share_of(card, work, over["passes"] + over["transfers"]) == math.inf


def test_kernels_a_pass_stream_their_state() -> None:
    work = {"pixels": 100, "written_bytes": 48, "texel_bytes": {"state_texel_0": 16}, "kernels": [
        {"vector": 5, "fetches": {"state_texel_0": 1, "kd_node_table": 1}, "runs": 70,
         "passes": 9}]}
    found = kernel_work(work)
    assert (found.instructions, found.texels, found.passes, found.pixels) == (350, 140, 9, 100)
    assert found.streamed == 70 * 48 + 70 * 16


def test_the_command_prints_them(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["hardware", "--json"]) == 0
    assert [card["chip"] for card in json.loads(capsys.readouterr().out)] == list(CHIPS)
    assert main(["hardware"]) == 0
    assert "NVIDIA GeForce 8800 GTX" in capsys.readouterr().out


def test_a_scene_alone_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["hardware", "--scene", "kitchen"]) == 1
    said = capsys.readouterr()
    assert "--methods" in said.err and not said.out
