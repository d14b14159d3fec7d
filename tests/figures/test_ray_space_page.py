"""The tables of docs/notes/ray-space.md equal measured numbers."""
from __future__ import annotations

from pathlib import Path

import pytest
from conftest import real_scene

import gpgpu_rt as rt
from gpgpu_rt.bench import workloads
from gpgpu_rt.figures.experiments import coherence

PAGE = Path(__file__).parents[2] / "docs" / "notes" / "ray-space.md"
SCENES = ("bunny", "robots", "kitchen", "conference")
WORK = {"eye": workloads.EYE, "shadow": workloads.SHADOW, "mirror, once": workloads.mirror(1),
        "diffuse, once": workloads.diffuse(1), "diffuse, twice": workloads.diffuse(2)}


def rows() -> list[list[str]]:
    """Returns the cells of all rows of all tables. An empty first cell repeats the first cell of
    the row above."""
    found: list[list[str]] = []
    for line in PAGE.read_text().splitlines():
        if line.startswith("|") and "---" not in line:
            cells = [cell.strip(" `") for cell in line.strip("|").split("|")]
            found.append([cells[0] or found[-1][0], *cells[1:]])
    return found


def number(word: str) -> float:
    return float(word.replace(",", ""))


def counters(scene: str, method: str, packet: tuple[int, int], **options: object) -> list[float]:
    """Returns the mean numbers of nodes that a packet visits and of triangles that it tests. In a
    grid, the nodes are cells."""
    with rt.Tracer(real_scene(scene), method, packet=packet, statistics=True,
                   **options) as tracer:
        tracer.trace(*tracer.scene.camera.rays((256, 256)))
        found = tracer.statistics.counters
    return [found["nodes_visited"], found["triangles_tested"] / (packet[0] * packet[1])]


@pytest.mark.parametrize("packet", [
    (4, 2), *(pytest.param(p, marks=pytest.mark.full) for p in ((2, 2), (4, 4)))], ids=str)
@pytest.mark.parametrize("scene", [
    s if s == "bunny" else pytest.param(s, marks=pytest.mark.full) for s in SCENES])
def test_culling_saves_what_the_page_says(scene: str, packet: tuple[int, int]) -> None:
    table = {row[1]: row[2 + SCENES.index(scene)] for row in rows()
             if row[0] == f"{packet[0]}x{packet[1]}"}
    for name, on in (("all of a leaf", False), ("culled", True)):
        tests = counters(scene, "bvh-packet", packet, vertex_culling=on)[1]
        assert number(table[name]) == pytest.approx(tests, rel=0.01, abs=0.06)


@pytest.mark.full
@pytest.mark.parametrize("scene", SCENES)
def test_packets_in_a_grid_visit_the_cells_that_the_page_says(scene: str) -> None:
    for name, packet in (("a single ray", (1, 1)), ("a packet of 16 rays", (4, 4))):
        for what, counted in zip(("cells", "tests"), counters(scene, "grid", packet)):
            said = next(row[2:] for row in rows() if row[:2] == [name, what])
            assert number(said[SCENES.index(scene)]) == pytest.approx(counted, rel=0.01, abs=0.6)


@pytest.mark.full
@pytest.mark.parametrize("name", WORK)
def test_coherence_is_as_the_page_says(name: str) -> None:
    real_scene("kitchen")
    found = coherence.measure(workloads.load("kitchen"),
                              workloads.workload("kitchen", WORK[name], 512))
    plain, ordered = found["distinct_as_they_come"], found["distinct_sorted"]
    said = next(row[1:] for row in rows() if row[0] == name)
    assert [number(word) for word in said] == pytest.approx([
        found["nodes_a_ray"], plain, ordered, plain / ordered,
        found["waiting_as_they_come"], found["waiting_sorted"]], rel=0.01)
