"""Tests of the data of graphics cards: rates and limits."""
from __future__ import annotations

import json
import re

import pytest

from gpgpu_rt.cli.main import main
from gpgpu_rt.cli.shared import WIDTH
from gpgpu_rt.errors import OptionError
from gpgpu_rt.hardware.cards import Needs, cards, find_card

CHIPS = ("R200", "NV25", "R300", "R420", "NV40", "R580", "G80")


def test_every_card_has_every_figure_with_its_source() -> None:
    assert tuple(card.chip for card in cards()) == CHIPS
    names = [set(card.figures) for card in cards()]
    assert all(one == names[0] for one in names)
    for card in cards():
        for figure in card.figures.values():
            assert set(figure) == {"value", "unit", "source", "read"} and figure["source"]


def test_recalled_figures_are_marked() -> None:
    """A number from memory is marked as not read from a document."""
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


def test_the_command_prints_the_cards(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["hardware", "--json"]) == 0
    assert [card["chip"] for card in json.loads(capsys.readouterr().out)] == list(CHIPS)
    assert main(["hardware"]) == 0
    text = capsys.readouterr().out
    assert max(map(len, text.splitlines())) <= WIDTH
    rows = [re.split("  +", line) for line in text.splitlines()]
    for card in cards():
        assert [card.chip, card.name, str(card.year)] in [row[:3] for row in rows]
    # A figure without a unit has one cell less, because the cell of the unit is empty.
    numbers = {row[0].replace(" ", "_"): row[1:] for row in rows
               if len(row) in (8, 9) and not row[0].startswith("-")}
    texts = {"bus", "precision", "exact_integers"}
    assert numbers.keys() - {"figure"} == set(cards()[0].figures) - texts
    assert numbers["figure"] == ["unit", *CHIPS]
    assert numbers["clock"] == ["MHz", "275", "300", "325", "520", "400", "650", "1,350"]
    assert numbers["branching"] == ["no"] * 4 + ["yes"] * 3
    assert numbers["local_arrays"] == ["no"] * 6 + ["yes"]
    assert numbers["loop_limit"][-1] == f"{find_card('G80').loop_limit:,}"
    assert numbers["issue_rate"][-1] == f"{find_card('G80').issue_rate / 1e9:g}"


def test_the_command_prints_only_the_cards_of_card(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["hardware", "--card", "g80,NV40,nv40", "--json"]) == 0
    assert [card["chip"] for card in json.loads(capsys.readouterr().out)] == ["NV40", "G80"]


def test_a_scene_alone_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["hardware", "--scene", "kitchen"]) == 1
    said = capsys.readouterr()
    assert "--methods" in said.err and not said.out
