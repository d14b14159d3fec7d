"""`gpgpu-rt program METHOD --card CARD` prints each kernel of a method with its costs on a
card."""
from __future__ import annotations

import json
import re

import numpy as np
import pytest
import trimesh

import gpgpu_rt as rt
from gpgpu_rt import cli
from gpgpu_rt.hardware.era_time import era_timed
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


def test_packets_have_the_kernels_of_their_loop(capsys) -> None:
    assert cli.main(["program", "kd-packet", "--card", "r580", "--skip-empty-leaves", "no"]) == 0
    text = capsys.readouterr().out
    assert text.startswith("kd-packet on ATI Radeon X1900 XTX, kernels in a loop\n")
    assert re.findall(r"^kernel (\w+)$", text, re.M) == [
        "traverse", "intersect", "leave", "begin", "pop", "push", "loop"]


@pytest.mark.parametrize("words, says", [
    (["kd-restart", "--card", "nv40", "--list"], "leave --list out"),
    (["kd-restart", "--card", "nv40", "--only", "dwn"], "did you mean down?"),
    (["bvh-packet", "--card", "nv40"], "has no era form"),
    (["kd-packet", "--card", "r580"], "written for skip_empty_leaves=False"),
    (["kd-restart", "--card", "nv40", "--interval", "strict"], "may lose hits"),
    (["kd-restart", "--card", "nv40", "--schedule", "loop"], "leave --schedule out"),
    (["bvh-threaded", "--card", "nv40", "--octants", "yes", "--shared-subtrees", "8"],
     "was not compiled for nv40 with these options")])
def test_mistakes_get_a_line(capsys, words: list[str], says: str) -> None:
    assert cli.main(["program", *words]) != 0
    assert says in capsys.readouterr().err


def _rendered(capsys, path, *words: str) -> str:
    assert cli.main(["render", "cornell", "-m", "kd-restart", "--size", "32", "-o",
                     str(path / "picture.png"), *words]) == 0
    return capsys.readouterr().out


def test_a_picture_in_the_era_form_says_what_the_card_would_have_taken(capsys, tmp_path) -> None:
    told = _rendered(capsys, tmp_path, "--era", "nv40")
    found = re.search(r"the NVIDIA GeForce 6800 Ultra would have taken about ([\d,]+) ms", told)
    assert found and int(found[1]) > 0
    shares = [int(share) for share in re.findall(r"(\d+)%", told)]
    assert 97 <= sum(shares) <= 103     # percentages, each rounded
    assert "would have taken" not in _rendered(capsys, tmp_path)
    assert "the ATI Radeon 9700 Pro would have taken about" in _rendered(
        capsys, tmp_path, "--era", "r300")
    assert "in fp24 a kd-tree loses hits" in _rendered(capsys, tmp_path, "--era", "r420")
    data = json.loads(_rendered(capsys, tmp_path, "--era", "NV40", "--json"))
    assert data["options"]["era"] == "nv40"
    assert data["on_card"]["seconds"] == pytest.approx(sum(data["on_card"]["parts"].values()))


def test_a_card_that_could_not_hold_the_scene_gets_no_time(capsys, tmp_path) -> None:
    scene = tmp_path / "many.ply"
    corners = np.random.default_rng(3).normal(size=(140_000, 3, 3))
    trimesh.Trimesh(corners.reshape(-1, 3), np.arange(420_000).reshape(-1, 3),
                    process=False).export(scene)
    assert cli.main(["render", str(scene), "-m", "bvh-threaded", "--build", "lbvh", "--size", "8",
                     "--era", "r420", "-o", str(tmp_path / "picture.png")]) == 0
    assert ("no prediction: the ATI Radeon X800 XT PE could not have run the method, which needs"
            in capsys.readouterr().out)


def test_nearest_and_any_hits_are_summed() -> None:
    """The kernel `intersect` has one program for nearest hits and another for any hits. The
    predicted time of both calls is the sum of their times."""
    scene = rt.load_scene("cornell")
    rays = scene.camera.rays((32, 32))
    seconds = {}
    with rt.Tracer(scene, "kd-restart", era="nv40") as tracer:
        for name, calls in (("nearest", [tracer.trace]), ("any", [tracer.occluded]),
                            ("both", [tracer.trace, tracer.occluded])):
            with era_timed(tracer) as seen:
                for call in calls:
                    call(*rays)
            seconds[name] = seen.on_card()[1].seconds
    assert seconds["both"] == pytest.approx(seconds["nearest"] + seconds["any"], rel=1e-6)


def test_twice_the_passes_take_twice_the_time(tmp_path) -> None:
    scene = rt.load_scene("cornell")
    rays = scene.camera.rays((32, 32))
    with rt.Tracer(scene, "kd-restart", era="nv40") as tracer:
        seconds = []
        for times in (1, 2):
            with era_timed(tracer) as seen:
                for _ in range(times):
                    tracer.trace(*rays)
            card, time = seen.on_card()
            assert card.chip == "NV40"
            seconds.append(time.seconds)
    assert seconds[1] == pytest.approx(2 * seconds[0], rel=1e-6)
