"""Tests of verdicts: the rules, the least numbers of scenes and pairs that a verdict needs, and
the words on pages."""
from __future__ import annotations

import json
from dataclasses import asdict, replace
from pathlib import Path

import pytest

from gpgpu_rt.figures.framework import provenance, verdicts
from gpgpu_rt.figures.framework.verdicts import Claim, MethodTimes, Pair, Verdict

TIMES = (1.0, 2.0, 4.0)      # times of three methods, so three pairs in a group


def _groups(ours: tuple, *scenes: str, stand_in: bool = False) -> list[MethodTimes]:
    return [MethodTimes(scene, scene, ours, TIMES, stand_in) for scene in scenes]


@pytest.mark.parametrize("ours, word, agreed", [
    ((10, 20, 40), verdicts.REPRODUCED, 6), ((10, 100, 1000), verdicts.ORDER, 6),
    ((40, 20, 10), verdicts.CONTRADICTED, 0), ((20, 20, 20), verdicts.CONTRADICTED, 0)],
    ids=["same", "order", "reversed", "all equal"])
def test_verdicts_follow_from_order_and_ratio(ours: tuple, word: str, agreed: int) -> None:
    said = verdicts.of_groups(_groups(ours, "bunny", "robots"))
    assert (said.word, said.scenes, said.pairs, said.agreed) == (
        word, ("bunny", "robots"), 6, agreed)
    faster = verdicts.of_groups(_groups(tuple(ns / 1000 for ns in ours), "bunny", "robots"))
    assert faster.word == word  # machine speed does not count


@pytest.mark.parametrize("ours", [(10, 20, 40), (40, 20, 10)], ids=["same", "reversed"])
def test_one_scene_is_too_little(ours: tuple) -> None:
    said = verdicts.of_groups(_groups(ours, "bunny", "bunny"))
    assert (said.word, said.scenes, said.pairs) == (verdicts.TOO_LITTLE, ("bunny",), 6)
    assert "needs 2 scenes and 4 pairs of methods, not 1 scene and 6 pairs" in said.why
    assert "tau-b is 0.8 or more in" in said.why     # the numbers are still shown


@pytest.mark.parametrize("scenes, word", [(3, verdicts.TOO_LITTLE), (4, verdicts.CONTRADICTED)])
def test_three_pairs_are_too_little(scenes: int, word: str) -> None:
    said = verdicts.of_groups(
        [MethodTimes(f"s{at}", f"s{at}", (2, 1), (1, 2)) for at in range(scenes)])
    assert (said.word, said.pairs) == (word, scenes)


def test_published_times_that_tie_are_no_pairs() -> None:
    """A scene on which all published times tie is not a scored scene."""
    tied = MethodTimes("conference", "conference, primary", (344, 179), (16.0, 16.7))
    said = verdicts.of_groups([tied, *_groups(TIMES, "bunny")])
    assert (said.word, said.scenes, said.pairs) == (verdicts.TOO_LITTLE, ("bunny",), 3)
    assert "tie: conference, primary" in said.why
    alone = verdicts.of_groups([tied])
    assert (alone.word, alone.scenes, alone.pairs) == (verdicts.TOO_LITTLE, (), 0)
    assert f"factor of {verdicts.number(344 / 179 * 16.7 / 16)}" in alone.why


def test_stand_ins_are_reported_but_never_scored() -> None:
    aside = _groups((4, 2, 1), "cows", "kitchen", stand_in=True)
    said = verdicts.of_groups(_groups(TIMES, "bunny", "robots") + aside)
    assert (said.word, said.scenes, said.pairs) == (verdicts.REPRODUCED, ("bunny", "robots"), 6)
    assert said.stand_ins is not None
    assert (said.stand_ins.word, said.stand_ins.scenes, said.stand_ins.pairs) == (
        verdicts.CONTRADICTED, ("cows", "kitchen"), 6)
    assert verdicts.rests_on(said) == "2 scored scenes (bunny, robots) and 6 pairs of methods"
    assert ("2 stand-ins (cows, kitchen) and 6 pairs of methods would be \"contradicted\":"
            in verdicts.stand_ins_say(said))
    only = verdicts.of_groups(aside)
    assert (only.word, only.scenes, only.pairs) == (verdicts.TOO_LITTLE, (), 0)
    assert verdicts.stand_ins_say(only) and not verdicts.stand_ins_say(
        verdicts.of_groups(_groups(TIMES, "bunny")))


def test_nothing_measured() -> None:
    assert verdicts.of_groups([]).word == verdicts.UNMEASURED
    single = MethodTimes("bunny", "bunny", (1,), (1,))
    assert verdicts.of_groups([single]).word == verdicts.UNMEASURED
    assert verdicts.of_claims([]).word == verdicts.UNMEASURED


def test_ratios_are_off_by_the_median_over_pairs() -> None:
    # The published times are equal, so the published ratios between methods are 1. Our ratios are
    # 2, 4 and 8, with the median 4.
    assert verdicts.off_by((1, 2, 8), (1, 1, 1)) == pytest.approx(4)
    assert verdicts.off_by((5, 10, 40), (1, 2, 8)) == pytest.approx(1)


@pytest.mark.parametrize("holds, word", [
    ((True, True), verdicts.REPRODUCED), ((True, True, False), verdicts.MOSTLY),
    ((True, False), verdicts.REFUTED), ((True, None), verdicts.REPRODUCED),
    ((None, None), verdicts.TOO_LITTLE), ((), verdicts.UNMEASURED)])
def test_verdicts_on_claims(holds: tuple[bool | None, ...], word: str) -> None:
    """Claims about the structure of methods need no scene. Claims that are not decided are not
    counted."""
    said = verdicts.of_claims(Claim(f"claim {at}", one) for at, one in enumerate(holds))
    assert said.word == word and said.why.count("(no)") == holds.count(False)
    assert (said.held, said.claims) == (holds.count(True), len(holds) - holds.count(None))
    assert said.structure == said.claims and said.scenes == ()
    assert said.why.count("(not decided)") == holds.count(None)


def _claims(scenes: int, pairs: int, holds: bool = False, **more: bool) -> list[Claim]:
    """Returns ``scenes`` claims, each on a scene of its own. Each claim compares ``pairs`` pairs
    of methods."""
    return [Claim(f"claim on s{at}", holds, (f"s{at}",),
                  tuple(Pair(f"s{at}", "eye rays", "grid", f"m{k}") for k in range(pairs)), **more)
            for at in range(scenes)]


@pytest.mark.parametrize("scenes, pairs, word", [
    (1, 9, verdicts.TOO_LITTLE), (3, 1, verdicts.TOO_LITTLE), (2, 2, verdicts.CONTRADICTED),
    (1, 0, verdicts.TOO_LITTLE), (2, 0, verdicts.CONTRADICTED)])
def test_claims_about_scenes_need_scenes_and_pairs(scenes: int, pairs: int, word: str) -> None:
    """A claim that compares no methods needs enough scenes, but no pairs of methods."""
    said = verdicts.of_claims(_claims(scenes, pairs))
    assert (said.word, len(said.scenes), said.pairs) == (word, scenes, scenes * pairs)
    assert ("compare none" in verdicts.rests_on(said)) == (pairs == 0)


def test_claims_on_the_same_pairs_count_them_once() -> None:
    said = verdicts.of_claims(_claims(2, 2) + _claims(2, 2, True))
    assert (said.pairs, said.claims, said.held) == (4, 4, 2)


def test_claims_on_stand_ins_and_exceptions() -> None:
    said = verdicts.of_claims(_claims(3, 2, True, stand_in=True), ["The scene x is out."])
    assert (said.word, said.scenes) == (verdicts.TOO_LITTLE, ())
    assert said.why.endswith("are stand-ins. The scene x is out.")
    assert said.stand_ins is not None and said.stand_ins.word == verdicts.REPRODUCED
    assert verdicts.of_claims([], ["The scene x is out."]).word == verdicts.TOO_LITTLE


def test_claims_about_a_method_are_judged_even_if_scenes_are_few() -> None:
    said = verdicts.of_claims([Claim("two planes a node", True), *_claims(1, 1)])
    assert (said.word, said.structure) == (verdicts.REPRODUCED, 1)
    assert verdicts.rests_on(said) == ("1 claim about a method itself, not about a scene; "
                                       "1 scored scene (s0) and 1 pair of methods")


def test_a_verdict_is_read_from_its_file(tmp_path: Path) -> None:
    said = verdicts.of_groups(_groups(TIMES, "bunny")
                              + _groups(TIMES, "cows", "kitchen", stand_in=True))
    said = replace(said, renderer=said)
    (tmp_path / "fig12.md").write_text("# A page")
    provenance.record("fig12", [], tmp_path, tmp_path, False, said)
    held = provenance.held("fig12", tmp_path)
    assert held is not None
    assert Verdict.from_json(held["verdict"]) == said
    assert set(held["verdict"]) == set(asdict(said)) and held["verdict"]["pairs"] == 3
    # A page that an older version drew has a verdict without counts. The page is not shown until
    # it is drawn again.
    held["verdict"] = {"word": verdicts.CONTRADICTED, "why": "one scene"}
    (tmp_path / "fig12.json").write_text(json.dumps(held))
    assert provenance.held("fig12", tmp_path) is None
