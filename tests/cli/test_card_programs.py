"""`gpgpu-rt program METHOD --card CARD` prints the kernels as a card's compiler left them."""
from __future__ import annotations

import json

import pytest

from gpgpu_rt import cli
from gpgpu_rt.hardware.static_costs import COMPILERS, era_programs, static_cost


@pytest.mark.parametrize("card", COMPILERS)
def test_every_kernel_has_its_counts_and_its_program(capsys, card: str) -> None:
    assert cli.main(["program", "kd-backtrack", "--card", card]) == 0
    text = capsys.readouterr().out
    for program in era_programs("kd-backtrack"):
        cost = static_cost(card, "kd-backtrack", program.kernel)
        part = text.partition(f"\nkernel {program.kernel}\n")[2].partition("\nkernel ")[0]
        assert f"arithmetic instructions{cost.arithmetic:15,}" in part
        assert f"texture fetches{cost.fetches:23,}" in part
        assert (cost.listing in part) and bool(cost.listing) == (card != "g80")


def test_limits_of_the_card_and_the_count_of_the_paper(capsys) -> None:
    assert cli.main(["program", "grid", "--card", "r420", "--only", "traverse"]) == 0
    text = capsys.readouterr().out
    assert "render targets                       3 of 4" in text
    assert "instructions in the paper       20 (Purcell et al. 2002" in text
    assert "from memory" in text and "kernel intersect" not in text


def test_json_and_file(capsys, tmp_path) -> None:
    assert cli.main(["program", "kd-restart", "--card", "nv40", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)
    assert [row["kernel"] for row in rows] == ["init", "down", "intersect"]
    assert rows[1]["arithmetic"] == static_cost("nv40", "kd-restart", "down").arithmetic
    path = tmp_path / "kernels.txt"
    assert cli.main(["program", "kd-restart", "--card", "nv40", "-o", str(path)]) == 0
    assert path.read_text().startswith("kd-restart on NVIDIA GeForce 6800 Ultra")


@pytest.mark.parametrize("words, says", [
    (["kd-restart", "--card", "nv40", "--list"], "leave --list out"),
    (["kd-restart", "--card", "nv40", "--only", "dwn"], "did you mean down?"),
    (["bvh-packet", "--card", "nv40"], "has no era form"),
    (["kd-restart", "--card", "nv40", "--interval", "strict"], "was not compiled for nv40")])
def test_mistakes_get_a_line(capsys, words: list[str], says: str) -> None:
    assert cli.main(["program", *words]) != 0
    assert says in capsys.readouterr().err
