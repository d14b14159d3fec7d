"""`gpgpu-rt program METHOD --card CARD` prints each kernel of a method with its costs on a
card."""
from __future__ import annotations

import json
import re

import numpy as np
import pytest
import trimesh

from gpgpu_rt import cli
from gpgpu_rt.hardware.cards import find_card
from gpgpu_rt.hardware.prediction import limit_of
from gpgpu_rt.hardware.static_costs import (
    COMPILERS, era_methods, era_programs, packet_methods, static_cost
)


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


def test_list_prints_counts_and_limits_without_the_programs(capsys) -> None:
    assert cli.main(["program", "kd-restart", "--card", "nv40", "--list"]) == 0
    text = capsys.readouterr().out
    assert re.findall(r"^kernel (\w+)$", text, re.M) == ["init", "down", "intersect"]
    assert "arithmetic instructions" in text and " of 4,096" in text
    assert "NVIDIA's own compiler probably needed fewer instructions" in text
    assert static_cost("nv40", "kd-restart", "down").listing not in text
    assert len(text.splitlines()) < 50
    assert cli.main(["program", "kd-restart", "--card", "nv40", "--list", "--json"]) == 0
    assert all("listing" not in row for row in json.loads(capsys.readouterr().out))


def test_slots_are_explained_where_an_instruction_has_two(capsys) -> None:
    for card, two in (("r300", True), ("r420", True), ("nv40", False)):
        assert cli.main(["program", "kd-restart", "--card", card, "--list"]) == 0
        text = capsys.readouterr().out
        assert ("an instruction occupies two" in text) == two
        cost = static_cost(card, "kd-restart", "down")
        assert cost.slots == (2 if two else 1) * cost.arithmetic


def test_packets_have_the_kernels_of_their_loop(capsys) -> None:
    assert cli.main(["program", "kd-packet", "--card", "r580", "--skip-empty-leaves", "no"]) == 0
    text = capsys.readouterr().out
    assert cli.main(["program", "kd-packet", "--card", "r580"]) == 0
    assert capsys.readouterr().out == text
    assert text.startswith("kd-packet on ATI Radeon X1900 XTX, kernels in a loop\n")
    assert re.findall(r"^kernel (\w+)$", text, re.M) == [
        "traverse", "intersect", "leave", "begin", "pop", "push", "loop"]


@pytest.mark.parametrize("method, card", [
    (method, card) for card in COMPILERS for method in (*era_methods(card), *packet_methods())])
def test_kernels_that_the_card_could_not_run_are_marked(capsys, method: str, card: str) -> None:
    assert cli.main(["program", method, "--card", card, "--list"]) == 0
    told = "could not have run these kernels: " + method in capsys.readouterr().out
    assert told == (limit_of(find_card(card), method) is not None) == (
        method in packet_methods() and not find_card(card).branching)


@pytest.mark.parametrize("words, says", [
    (["kd-restart", "--card", "nv40", "--all"], "leave --all out"),
    (["kd-restart", "--card", "nv40", "--list", "-o", "x.txt"], "leave --output or --list out"),
    (["kd-restart", "--card", "nv40", "--only", "dwn"], "did you mean down?"),
    (["bvh-packet", "--card", "nv40"], "has no era form"),
    (["kd-short-stack", "--card", "r420"], "has no era form for r420: its kernels write 6 "),
    (["bvh-stack", "--card", "nv40"], "methods with an era form: brute-force, grid, "),
    (["kd-packet", "--card", "r580", "--skip-empty-leaves", "yes"],
     "written for skip_empty_leaves=False"),
    (["kd-restart", "--card", "nv40", "--interval", "strict"], "may lose hits"),
    (["kd-restart", "--card", "nv40", "--schedule", "loop"], "leave --schedule out"),
    (["bvh-threaded", "--card", "nv40", "--octants", "yes", "--shared-subtrees", "8"],
     "was not compiled for nv40 with these options")])
def test_mistakes_get_a_line(capsys, words: list[str], says: str) -> None:
    assert cli.main(["program", *words]) != 0
    assert says in capsys.readouterr().err


def _rendered(capsys, path, *words: str, method: str = "kd-restart") -> str:
    assert cli.main(["render", "cornell", "-m", method, "--size", "32", "-o",
                     str(path / "picture.png"), *words]) == 0
    return capsys.readouterr().out


def test_a_picture_in_the_era_form_says_what_the_card_would_have_taken(capsys, tmp_path) -> None:
    told = _rendered(capsys, tmp_path, "--era", "nv40")
    found = re.search(r"the NVIDIA GeForce 6800 Ultra would have taken about ([\d,]+) ms", told)
    assert found and int(found[1]) > 0
    for line in (line for line in told.splitlines() if "would have taken" in line):
        shares = [int(share) for share in re.findall(r"(\d+)%", line)]
        assert 97 <= sum(shares) <= 103     # percentages, each rounded
    assert "would have taken" not in _rendered(capsys, tmp_path)
    assert "the ATI Radeon 9700 Pro would have taken about" in _rendered(
        capsys, tmp_path, "--era", "r300")
    assert "in fp24 a kd-tree loses hits" in _rendered(capsys, tmp_path, "--era", "r420")
    data = json.loads(_rendered(capsys, tmp_path, "--era", "NV40", "--json"))
    assert data["options"]["era"] == "nv40"
    assert data["on_card"]["seconds"] == pytest.approx(sum(data["on_card"]["parts"].values()))


@pytest.mark.parametrize("chip, says", [
    ("nv30", "the NV30 is left out, because it has a single render target"),
    ("r42", "did you mean r420")])
def test_program_says_why_a_chip_is_missing(capsys, chip: str, says: str) -> None:
    with pytest.raises(SystemExit):
        cli.main(["program", "kd-restart", "--card", chip])
    assert says in capsys.readouterr().err


@pytest.mark.parametrize("chip, says", [
    ("g80", "gpgpu-rt hardware --predict METHOD"),
    ("nv30", "the NV30 is left out, because it has a single render target"),
    ("6800", "nv40 (NVIDIA GeForce 6800 Ultra), r580 (ATI Radeon X1900 XTX)")])
def test_chips_without_an_era_form_say_why(capsys, tmp_path, chip: str, says: str) -> None:
    assert cli.main(["render", "cornell", "-m", "grid", "--era", chip, "-o",
                     str(tmp_path / "picture.png")]) != 0
    error = capsys.readouterr().err
    assert says in error and "did you mean" not in error


def test_render_names_the_methods_with_an_era_form(capsys, tmp_path) -> None:
    assert cli.main(["render", "cornell", "-m", "ray-engine", "--era", "r420", "-o",
                     str(tmp_path / "picture.png")]) != 0
    assert "methods with an era form: brute-force, grid, " in capsys.readouterr().err


def test_a_scene_with_too_many_triangles_gets_no_time(capsys, tmp_path) -> None:
    scene = tmp_path / "many.ply"
    rng = np.random.default_rng(3)      # small triangles, which a ray seldom meets
    corners = rng.normal(size=(140_000, 1, 3)) + rng.normal(size=(140_000, 3, 3), scale=1e-3)
    trimesh.Trimesh(corners.reshape(-1, 3), np.arange(420_000).reshape(-1, 3),
                    process=False).export(scene)
    assert cli.main(["render", str(scene), "-m", "bvh-threaded", "--build", "lbvh", "--size", "8",
                     "--era", "r420", "-o", str(tmp_path / "picture.png")]) == 0
    text = capsys.readouterr().out
    assert re.search(r"no prediction: the ATI Radeon X800 XT PE could not have run the method, "
                     r"which needs [\d,]+ exact integers, the card has 131,072", text)


def test_a_time_names_its_form_its_rays_and_the_size(capsys, tmp_path) -> None:
    """A line of the output gives the form whose times the figures compare with the papers' times.
    Another line gives the form in which the kernels ran."""
    step, passes = (line for line in _rendered(capsys, tmp_path, "--era", "nv40").splitlines()
                    if "would have taken" in line)
    assert "form step: " in step and "era_machine` compares" in step and "as here" not in step
    assert "form passes: one kernel per pass, as here;" in passes and "compares" not in passes
    for line in (step, passes):
        assert "32x32 pixels" in line and "waiting lanes" in line
        assert "rays: eye rays and other nearest-hit rays, shadow rays; " in line
    data = json.loads(_rendered(capsys, tmp_path, "--era", "nv40", "--json"))["on_card"]
    assert data["form"] == "one kernel per pass" and len(data["rays"]) == 2
    assert data["size"] == [32, 32] and list(data["forms"]) == ["step", "passes"]
    assert data["forms"]["passes"]["seconds"] == data["seconds"]
    assert data["ran"] == "passes"
    told, text = (_rendered(capsys, tmp_path, "--era", "nv40", *more, method="kd-packet")
                  for more in ([], ["--json"]))
    data = json.loads(text)["on_card"]
    assert f"form {data['ran']}: {data['form']}, as here" in told
    (both,) = (line for line in _rendered(capsys, tmp_path, "--era", "r420").splitlines()
               if "would have taken" in line)
    assert "era_machine` compares" in both and "as here" in both


def test_methods_says_which_methods_have_an_era_form(capsys) -> None:
    assert cli.main(["methods"]) == 0
    rows = dict(line.split()[:2] for line in capsys.readouterr().out.partition("\n\n")[0]
                .splitlines()[2:])
    assert cli.main(["methods", "--json"]) == 0
    forms = {row["name"]: row["era_form"] for row in json.loads(capsys.readouterr().out)}
    assert {name: word != "-" for name, word in rows.items()} == forms
    assert [name for name, word in rows.items() if word == "loop"] == ["kd-packet"]
    assert forms["kd-restart"] and not forms["bih"]
