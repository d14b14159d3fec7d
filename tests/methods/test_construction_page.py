"""The tables of docs/construction.md, and the table of GPU passes in docs/notes/builds.md, hold
the values that these tests measure."""
from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import pytest
from conftest import real_scene

import gpgpu_rt as rt
from gpgpu_rt.gl.algorithms.streams import StreamRoom
from gpgpu_rt.methods.bvh.build import build_bvh
from gpgpu_rt.methods.bvh.builders import BUILD_OPTIONS
from gpgpu_rt.methods.bvh.gpu_build.build import GPU_BUILDS, build_bvh_by_passes
from gpgpu_rt.methods.quality import sah_cost

PAGE = Path(__file__).parents[2] / "docs" / "construction.md"
NOTE = PAGE.parent / "notes" / "builds.md"
SCENES = ("bunny", "robots", "kitchen")
ROWS = {f"`{build}`" + (", gpu" if device == "gpu" else ""): (build, device)
        for build in BUILD_OPTIONS[0].choices for device in ("cpu", "gpu")
        if (build, device) != ("lbvh", "gpu")}      # no row: the GPU builds the CPU's tree


def tables() -> list[dict[str, dict[str, str]]]:
    """Return the tables of page and note: name of a row -> scene -> text of the cell.

    The third table comes from the note. Each cell of this table has two numbers: all passes, and
    the passes that scatter.
    """
    found: list[dict[str, dict[str, str]]] = []
    for line in (PAGE.read_text() + NOTE.read_text()).splitlines():
        name, *values = (cell.strip() for cell in line.strip("|").split("|"))
        if line.startswith("| build"):
            found.append({})
        elif line.startswith("| `"):
            found[-1][name] = dict(zip(SCENES, values))
    return found


def reinserted() -> dict[tuple[int, str, str], float]:
    """Return the page's SAH costs: (rounds of reinsertion, build, scene) -> cost."""
    rows = re.findall(r"^\| (\d+), (\S+) \| (.*) \|$", PAGE.read_text(), re.MULTILINE)
    return {(int(rounds), build, scene): float(cost) for rounds, build, costs in rows
            for scene, cost in zip(SCENES, costs.split(" | "))}


@pytest.mark.parametrize("rounds, build, scene", [
    pytest.param(*case, marks=() if case[0] == 1 else pytest.mark.full) for case in reinserted()])
def test_reinserted_trees_cost_what_the_page_says(rounds: int, build: str, scene: str) -> None:
    tree = build_bvh(real_scene(scene).triangles, build=build, reinsertion=rounds)
    assert sah_cost(tree) == pytest.approx(reinserted()[rounds, build, scene], rel=0.006)


@pytest.mark.parametrize("scene, row", [
    pytest.param(scene, row, id=f"{scene}-{row}", marks=() if scene == "bunny"
                 and row == "`lbvh`" else pytest.mark.full)
    for scene in SCENES for row in tables()[0]])
def test_trees_are_as_the_page_says(scene: str, row: str) -> None:
    build, device = ROWS[row]
    costs, steps, _ = tables()
    with rt.Tracer(real_scene(scene), "bvh-threaded", build=build, build_device=device,
                   statistics=True) as tracer:
        hits = tracer.trace(*tracer.scene.camera.rays((256, 256)))
        cost = sah_cost(tracer.accelerator.structure)
    assert cost == pytest.approx(float(costs[row][scene]), rel=0.006)
    assert (hits.nodes_visited + hits.triangles_tested).mean() == pytest.approx(
        float(steps[row][scene]), rel=0.006)


@pytest.mark.parametrize("scene, build", [
    pytest.param(scene, build, marks=() if scene == "bunny" and build == "lbvh"
                 else pytest.mark.full) for scene in SCENES for build in GPU_BUILDS])
def test_passes_are_as_many_as_the_note_says(gpu, monkeypatch, scene: str, build: str) -> None:
    drawn = Counter()
    for name in ("draw", "scatter"):
        def counting(self, *given, _draw=getattr(StreamRoom, name), _name=name, **more):
            drawn[_name] += 1
            return _draw(self, *given, **more)
        monkeypatch.setattr(StreamRoom, name, counting)
    build_bvh_by_passes(gpu, real_scene(scene).triangles, build=build)
    said = tables()[2][f"`{build}`"][scene]
    assert said == f"{drawn['draw'] + drawn['scatter']}, {drawn['scatter']}"


def test_every_build_has_its_row_and_paragraph() -> None:
    builds = set(BUILD_OPTIONS[0].choices)
    for table in tables()[:2]:
        assert {ROWS[row][0] for row in table} == builds
    assert all(f"**`{build}`**" in PAGE.read_text() for build in builds)
