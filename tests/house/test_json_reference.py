"""docs/reference/json.md has the fields that `bench`, `accuracy`, `render --era` and
`hardware --predict` print, and no others."""
from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from gpgpu_rt.cli import main

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "json.md"
WITHOUT_EMBREEX = {"over_embree", "over_embree_wall"}    # fields that are missing without embreex
# The tables of the page, in their order.
BOTH, BENCH, RACE, ENTRY, ACCURACY, ROW, SCORE, ON_CARD, PREDICT, CARD_TIME = range(10)


def fields() -> list[set[str]]:
    """Returns the names in the first column of each table."""
    tables = re.findall(r"(?:^\|.*\n)+", PAGE.read_text(), re.M)
    return [{name for row in table.splitlines()[2:]
             for name in re.findall(r"`(\w+)`", row.split("|")[1])} for table in tables]


def printed(capsys: pytest.CaptureFixture[str], *words: str) -> dict:
    assert main([*words, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def test_bench(capsys: pytest.CaptureFixture[str]) -> None:
    found = printed(capsys, "bench", "cornell", "--size", "16", "--runs", "1", "--engine", "none",
                    "-m", "kd-restart", "--statistics")
    race = found["races"][0]
    page = fields()
    assert found.keys() == page[BOTH] | page[BENCH]
    assert race.keys() == page[RACE]
    assert race["entries"][0].keys() == page[ENTRY] - WITHOUT_EMBREEX


def test_accuracy(capsys: pytest.CaptureFixture[str]) -> None:
    found = printed(capsys, "accuracy", "cornell", "--methods", "kd-restart", "--rays", "100",
                    "--size", "16x16")
    row = found["rows"][0]
    page = fields()
    assert found.keys() == page[BOTH] | page[ACCURACY]
    assert row.keys() == page[ROW]
    assert row["all"].keys() == row["kinds"]["eye"].keys() == page[SCORE]
    assert row["image"].keys() == {"rmse", "differing", "flip"}


@pytest.mark.parametrize("method", ["kd-restart", "kd-packet"])
def test_render_in_the_era_form(capsys: pytest.CaptureFixture[str], tmp_path: Path,
                                method: str) -> None:
    found = printed(capsys, "render", "cornell", "-m", method, "--era", "nv40", "--size", "16",
                    "-o", str(tmp_path / "picture.png"))["on_card"]
    assert found.keys() == fields()[ON_CARD]
    ran = found["forms"][found["ran"]]
    assert ran == {name: found[name] for name in ("seconds", "parts")}


def test_hardware_predict(capsys: pytest.CaptureFixture[str]) -> None:
    found = printed(capsys, "hardware", "--predict", "kd-packet", "--size", "16", "--card",
                    "r420,nv40")
    page = fields()
    assert found.keys() == page[BOTH] | page[PREDICT]
    refused, timed = found["predictions"]
    assert refused.keys() | timed.keys() == page[CARD_TIME]
    assert refused["limit"] == "loops"
