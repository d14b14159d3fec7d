"""The tables of counters in docs/kd-trees.md equal measured numbers."""
from __future__ import annotations

import re
from pathlib import Path

import pytest
from snippets import without_meshes

import gpgpu_rt as rt
from gpgpu_rt.scene import catalogue

PAGE = Path(__file__).parents[2] / "docs" / "kd-trees.md"
SCENES = ("cornell", "bunny", "robots", "kitchen", "conference")
SLOW = ("kd-texture-stack",)  # needs seconds per scene


def _rows() -> dict[str, dict[str, float]]:
    """Returns the rows of all counter tables: first cell -> scene -> number. A counter table has a
    column for every scene."""
    lines = [line.strip("|").split("|") for line in PAGE.read_text().splitlines()
             if line.startswith("|") and "---" not in line]
    return {name.strip(" `"): dict(zip(SCENES, map(float, values))) for name, *values in lines
            if len(values) == len(SCENES) and values[0].strip() != SCENES[0]}


def _cases() -> list:
    return [pytest.param(scene, method, id=f"{scene}-{method}", marks=[pytest.mark.full]
                         if scene != "cornell" or method in SLOW else [])
            for scene in SCENES for method in _rows() if method.startswith("kd-")]


@pytest.mark.parametrize("scene, method", _cases())
def test_counters_are_as_the_page_says(scene: str, method: str) -> None:
    if catalogue.mesh_path(scene) is None:
        pytest.skip(f"the page is about the mesh of {scene}; name its folder in GPGPU_RT_SCENES")
    with rt.Tracer(scene, method, statistics=True) as tracer:
        tracer.trace(*tracer.scene.camera.rays((256, 256)))
        counters, single = tracer.statistics.counters, not tracer.method.packet
    rows = _rows()
    assert counters["nodes_visited"] == pytest.approx(rows[method][scene], rel=0.006)
    if single:
        for name in ("leaves visited", "triangles tested"):
            assert counters[name.replace(" ", "_")] == pytest.approx(rows[name][scene], rel=0.006)


@pytest.mark.parametrize("scene", ["cornell", pytest.param("bunny", marks=pytest.mark.full)])
def test_counters_without_the_meshes_are_as_the_page_says(scene: str, tmp_path: Path) -> None:
    said = re.search(r"`kd-restart` then visits (\S+) nodes on the bunny and (\S+) on cornell",
                     PAGE.read_text())
    assert said is not None
    with without_meshes(tmp_path), rt.Tracer(scene, "kd-restart", statistics=True) as tracer:
        tracer.trace(*tracer.scene.camera.rays((256, 256)))
        assert tracer.statistics.counters["nodes_visited"] == pytest.approx(
            float(said[1 if scene == "bunny" else 2]), rel=0.006)


def test_every_method_of_the_family_has_its_row_and_paragraph() -> None:
    family = {row.name for row in rt.methods() if row.name.startswith("kd-")}
    assert family == {name for name in _rows() if name.startswith("kd-")}
    assert all(f"**`{name}`**" in PAGE.read_text() for name in family)
