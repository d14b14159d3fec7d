"""`gpgpu-rt hardware --methods` lists the methods that each card could have run. The command
compares every program of a method with the limits of the card."""
from __future__ import annotations

import json
from dataclasses import replace

import pytest

import gpgpu_rt as rt
from gpgpu_rt.cli import main
from gpgpu_rt.hardware import methods_on_cards
from gpgpu_rt.hardware.cards import cards, find_card
from gpgpu_rt.hardware.methods_on_cards import EraSize, era_refusals, era_sizes, method_needs
from gpgpu_rt.hardware.static_costs import static_cost

PAIRS = {(row.name, schedule) for row in rt.methods() for schedule in row.schedules}


@pytest.mark.parametrize("row", [
    pytest.param(row, id=row.name) for row in rt.methods()
    if {"kernels", "step"} <= set(row.schedules)])
def test_every_kernel_of_a_method_is_judged(row: rt.Method) -> None:
    asked = method_needs([row.name])[row.name, "kernels"]
    assert set(row.kernels) <= {label.split(" ")[0] for label in asked}


def test_the_largest_table_of_a_program_counts() -> None:
    """The draw with the largest table decides, not the last draw. Ray classification draws with
    lists of several sizes."""
    asked = method_needs(["ray-classification"])["ray-classification", "kernels"]
    assert max(one.largest_index for one in asked.values()) > find_card("R420").exact_integers


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> list[rt.Method]:
    """Replaces the table of methods by a table of three methods, for speed; returns its rows."""
    rows = [row for row in rt.methods() if row.name in ("grid", "kd-short-stack", "ray-tiles")]
    monkeypatch.setattr(methods_on_cards, "methods", lambda: rows)
    return rows


def _table(capsys: pytest.CaptureFixture[str]) -> tuple[dict[tuple[str, str], list[str]], str]:
    assert main(["hardware", "--methods"]) == 0
    text = capsys.readouterr().out
    assert max(map(len, text.splitlines())) <= 100
    lines = text.split("\n\n")[0].splitlines()[2:]
    return {(line.split()[0], line.split()[1]): line.split()[2:] for line in lines}, text


@pytest.mark.parametrize("method, indexes", [("kd-stack", True), ("bvh-stack", True),
                                             ("kd-short-stack", False), ("bih", False)])
def test_a_stack_in_a_local_array_needs_a_card_that_can_index_it(method: str,
                                                                 indexes: bool) -> None:
    asked = method_needs([method])[method, "loop"].values()
    for card in cards():
        refused = any(one.limit == "arrays" for needs in asked for one in card.refuses(needs))
        assert refused == (indexes and not card.local_arrays), card.chip


def test_the_table_fits_a_terminal_and_says_why(few, capsys) -> None:
    found, text = _table(capsys)
    assert set(found) == {("grid", "era"), ("kd-short-stack", "era"),
                          *((row.name, schedule) for row in few for schedule in row.schedules)}
    chips = [card.chip for card in cards()]
    at = {pair: dict(zip(chips, words)) for pair, words in found.items()}
    floats, rest = dict.fromkeys(chips[:2], "floats"), chips[2:]
    assert at["grid", "kernels"] == {**floats, **dict.fromkeys(rest, "-")}
    assert at["grid", "era"] == {**floats, **dict.fromkeys(rest, "yes")}
    assert at["grid", "loop"]["R420"] == "loops"
    assert at["kd-short-stack", "step"]["R580"] == "targets"
    assert at["kd-short-stack", "era"]["R580"] == "yes"     # the era form has a smaller state
    assert at["kd-short-stack", "era"]["R420"] == "targets"
    assert ("targets: for example kd-short-stack kernels on the R300: needs 6 render targets, "
            "the card has 4") in text


def test_json_has_every_reason_of_every_card(few, capsys) -> None:
    assert main(["hardware", "--methods", "--json"]) == 0
    found = {card["chip"]: card for card in json.loads(capsys.readouterr().out)}
    # Under `loop` the state stays in registers. Under `step` each pass writes the state.
    assert found["R420"]["refuses"]["kd-short-stack loop"] == [
        "needs loops, the card has no branches"]
    assert found["R420"]["refuses"]["kd-short-stack step"] == [
        "needs 6 render targets, the card has 4"]
    assert {"needs loops, the card has no branches",
            "needs float textures, the card has fixed, 9 bits in [-1, 1]"} <= set(
        found["NV25"]["refuses"]["kd-short-stack loop"])
    assert found["G80"]["refuses"]["grid kernels"] == []


def test_the_era_form_is_judged_by_every_kernel() -> None:
    """A card cannot run a method if a single kernel needs more than a limit of the card allows."""
    sizes = era_sizes(["kd-backtrack"])
    card = find_card("R420")
    assert not era_refusals(card, sizes)["kd-backtrack", "era"]
    for kernel in ("init", "down", "intersect", "climb"):
        cost = static_cost("r420", "kd-backtrack", kernel)
        tight = {**card.figures, "texture_slots": {"value": cost.fetches - 1}}
        assert era_refusals(replace(card, figures=tight), sizes)["kd-backtrack", "era"], kernel


def test_fp24_limits_numbers_but_not_tables() -> None:
    """On a card with fp24, a pointer to a node is a column and a row, so the number of nodes is
    not limited. The number of triangles is limited, because a hit stores the index of its triangle
    in one float."""
    card, many = find_card("R420"), 1 << 20
    for size, limits in ((EraSize(many, 1000), []), (EraSize(many, many), ["index"])):
        refused = era_refusals(card, {"kd-backtrack": size})["kd-backtrack", "era"]
        assert [one.limit for one in refused] == limits


@pytest.mark.parametrize("chip", ["R300", "R420"])
def test_a_short_stack_does_not_fit_into_fp24(chip: str) -> None:
    refused = era_refusals(find_card(chip), era_sizes(["kd-short-stack"]))["kd-short-stack", "era"]
    assert {one.limit for one in refused} == {"targets"}


@pytest.mark.full
def test_every_pair_is_judged() -> None:
    needs = method_needs()
    assert set(needs) == PAIRS and all(needs.values())
