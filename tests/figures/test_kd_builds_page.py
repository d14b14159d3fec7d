"""The table of builds in docs/kd-trees.md equals measured numbers."""
from __future__ import annotations

import pytest
from conftest import real_scene
from test_kd_page import PAGE, SCENES

import gpgpu_rt as rt
from gpgpu_rt.gl.fragment_pass import FragmentPass
from gpgpu_rt.methods import find_method
from gpgpu_rt.methods.kdtree.gpu_build.build import GPU_KD_BUILDS, build_kdtree_by_passes
from gpgpu_rt.methods.quality import quality
from gpgpu_rt.scene import catalogue

KD_BUILDS = next(o for o in find_method("kd-stack").options if o.name == "build").choices


BY_PASSES = ("hybrid, gpu",)  # GPU builds whose trees differ from numpy's


def _numbers() -> dict[tuple[str, str], dict[str, float]]:
    """Returns the table of the page: (build, counter) -> scene -> number."""
    lines = [line.strip("|").split("|") for line in PAGE.read_text().splitlines()
             if line.startswith("| ") and ": " in line]
    return {tuple(name.strip().split(": ")): dict(zip(SCENES, map(float, values)))
            for name, *values in lines}


@pytest.mark.parametrize("scene, build", [
    pytest.param(scene, build, id=f"{scene}-{build}",
                 marks=[pytest.mark.full] if scene != "cornell" else [])
    for scene in SCENES for build in (*KD_BUILDS, *BY_PASSES)])
def test_trees_are_as_the_page_says(scene: str, build: str) -> None:
    if catalogue.mesh_path(scene) is None:
        pytest.skip(f"the page is about the mesh of {scene}; name its folder in GPGPU_RT_SCENES")
    options = {"build": build.split(
        ",")[0], "build_device": "gpu" if build in BY_PASSES else "cpu"}
    with rt.Tracer(scene, "kd-stack", statistics=True, **options) as tracer:
        tracer.trace(*tracer.scene.camera.rays((256, 256)))
        counters = tracer.statistics.counters
        tree = quality(tracer.accelerator.structure)
    measured = {"leaves": tree["leaves"], "references": tree["references"],
                "SAH cost": tree["sah_cost"],
                "steps a ray": counters["nodes_visited"] + counters["triangles_tested"]}
    page = _numbers()
    for what, value in measured.items():
        assert value == pytest.approx(page[build, what][scene], rel=0.006), what


@pytest.mark.parametrize("build", GPU_KD_BUILDS)
@pytest.mark.parametrize("scene", [pytest.param(scene, marks=[pytest.mark.full] if
                                                scene != "cornell" else []) for scene in SCENES])
def test_passes_are_as_many_as_the_page_says(exact_renderer, monkeypatch, scene: str,
                                             build: str) -> None:
    drawn = []
    issue = FragmentPass.issue

    def counting(self, *given, **more):
        drawn.append(1)
        return issue(self, *given, **more)
    monkeypatch.setattr(FragmentPass, "issue", counting)
    build_kdtree_by_passes(exact_renderer, real_scene(scene).triangles, build=build)
    assert len(drawn) == _numbers()[build, "passes"][scene]


def test_every_build_has_its_rows_and_paragraph() -> None:
    builds = {*KD_BUILDS, *BY_PASSES}
    assert {build for build, _ in _numbers()} == builds
    assert len(_numbers()) == 4 * len(builds) + len(GPU_KD_BUILDS)
    assert all(f"**`{build}`**" in PAGE.read_text() for build in KD_BUILDS)
