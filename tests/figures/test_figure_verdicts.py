"""Figures that make claims get the right verdicts. The tests write the figures' measurements
(cells) with invented numbers."""
from __future__ import annotations

from pathlib import Path

import pytest
from faked_cells import write_cell

from gpgpu_rt.figures.framework import verdicts
from gpgpu_rt.figures.survey import fig05_ray_engine_times as fig05
from gpgpu_rt.figures.survey import fig07_proximity_clouds as fig07
from gpgpu_rt.figures.survey import fig08_teapot_in_stadium as fig08
from gpgpu_rt.figures.survey import fig10_kdtree_traversal as fig10
from gpgpu_rt.figures.survey import fig14_mirrors as fig14
from gpgpu_rt.figures.survey import fig17_rope_memory as fig17


def test_the_printed_pseudocode_is_refuted(tmp_path: Path) -> None:
    assert fig10.judge(tmp_path, False).word == verdicts.REFUTED


@pytest.mark.parametrize("grid, word", [
    ((1, 2, 4, 8, 16), verdicts.REPRODUCED), ((1, 1, 1, 2, 3), verdicts.MOSTLY),
    ((3, 1, 1, 1, 0.5), verdicts.CONTRADICTED)])
def test_the_stadium_s_verdict(grid: tuple, word: str, tmp_path: Path) -> None:
    for ratio, times in zip(fig08.RATIOS, grid):
        for method, options in fig08.METHODS:
            write_cell(fig08.cell(ratio, method, options, False), tmp_path,
                       ns_per_ray=100.0 * (times if method == "grid" else 1))
    said = fig08.judge(tmp_path, False)
    assert (said.word, len(said.scenes), said.pairs) == (word, 5, 10)


def _mirrors(scene: str, last: float, shared: float, folder: Path) -> None:
    """Writes Figure 14's cells for a scene.

    ``last`` is the rate of packets divided by the rate of single rays at the last bounce.
    ``shared`` is the number of nodes that a packet visits, divided by the number of nodes that
    one of its rays visits.
    """
    for bounces in fig14.BOUNCES:
        gain = 2 + (last - 2) * bounces / 5
        for method, ms, nodes in ((fig14.SINGLE, 1.0, 40.0),
                                  (fig14.PACKET, 1 / gain, 10.0 * shared)):
            write_cell(fig14.cell(scene, method, bounces, False), folder, median_ms=ms,
                       ns_per_ray=1,
                       counters={"nodes_visited": nodes})


@pytest.mark.parametrize("last, word", [
    (0.5, verdicts.REPRODUCED), (1.5, verdicts.CONTRADICTED), (3.0, verdicts.CONTRADICTED)])
def test_mirrors_verdict(last: float, word: str, tmp_path: Path) -> None:
    _mirrors("robots", last, 2.0, tmp_path)
    assert fig14.judge(tmp_path, False).word == verdicts.TOO_LITTLE
    _mirrors("kitchen", last, 2.0, tmp_path)
    said = fig14.judge(tmp_path, False)
    assert (said.word, said.scenes, said.pairs) == (word, ("robots", "kitchen"), 12)


def test_a_scene_whose_packets_stay_together_is_named_as_an_exception(tmp_path: Path) -> None:
    """Packets are faster on cornell. This result does not count: the claim is about packets whose
    rays separate, but on cornell the rays of a packet stay together."""
    for scene, last, shared in (("cornell", 3.0, 1.1), ("robots", 0.5, 2.0),
                                ("kitchen", 0.5, 1.3)):
        _mirrors(scene, last, shared, tmp_path)
    said = fig14.judge(tmp_path, False)
    assert (said.word, said.scenes) == (verdicts.REPRODUCED, ("robots", "kitchen"))
    assert said.why.count("cornell") == 1 and (
        "The scene cornell, of 10,000 triangles, is an exception and is not judged: after 5 "
        "mirrors a packet visits 1.1 times the nodes of one ray" in said.why)
    fig14.draw(tmp_path, tmp_path, False)
    page = (tmp_path / "fig14.md").read_text()
    assert page.count("is an exception") == 1 and page.count("The claim holds on") == 2


@pytest.mark.parametrize("plain, holds", [(1200.0, True), (800.0, False), (1040.0, None)])
def test_proximity_clouds_are_judged_only_beyond_the_spread(plain: float, holds: bool | None,
                                                            tmp_path: Path) -> None:
    """The runs of one method differ by 50 ms, so times that differ by 40 ms decide nothing."""
    for method, ms in ((fig07.METHOD, 1000.0), (fig07.PLAIN, plain)):
        write_cell(fig07.cell(method, False), tmp_path, median_ms=ms,
                   samples_ms=[ms - 20, ms + 30],
                   scene={"triangles": 6000, "stand_in": "the picture of Figure 7"},
                   statistics={"waves": 1, "passes": 1, "picture_passes": {}, "texture_bytes": 1})
    assert fig07.cell(fig07.METHOD, False).runs > 1     # one run has no spread
    said = fig07.judge(tmp_path, False)
    # One stand-in scene and one pair of methods are too little for any other verdict.
    assert said.word == verdicts.TOO_LITTLE and said.stand_ins is not None
    assert (said.stand_ins.word, said.stand_ins.pairs) == (verdicts.TOO_LITTLE, 1)
    assert (said.stand_ins.claims, said.stand_ins.held) == (
        int(holds is not None), int(bool(holds)))
    assert "differ by up to 0.05 s" in said.stand_ins.why
    fig07.draw(tmp_path, tmp_path, False)
    page = (tmp_path / "fig07.md").read_text()
    for row in ("| survey: GeForce 6800 GTX | 6 | 1 |", "| survey: Autodesk 3ds Max, CPU | 6.2 | "
                "1.03 |", "| here: grid-proximity | 1 | 1 |"):
        assert row in page


@pytest.mark.parametrize("pairs, bounds", [(10, True), (1000, False)])
def test_transfers_are_judged_on_the_bus_of_the_time(pairs: int, bounds: bool,
                                                     tmp_path: Path) -> None:
    """The verdict uses the time of a ray's bytes on the bus, not the renderer's time."""
    for scene in ("bunny", "kitchen"):
        cell = fig05.cell(scene, fig05.AS_IT_IS, False)
        rays = cell.size ** 2
        write_cell(cell, tmp_path, statistics={"trace_seconds": 9.0, "split": {
            "transfer_seconds": 0.0 if bounds else 9.0, "intersection_seconds": 9.0,
            "bytes_up": 533 * rays, "bytes_down": 199.5 * rays, "pairs": pairs * rays}})
    said = fig05.judge(tmp_path, False)
    assert said.word == (verdicts.REPRODUCED if bounds else verdicts.CONTRADICTED)
    assert (said.scenes, said.pairs, said.held) == (("bunny", "kitchen"), 0, 2 * bounds)
    assert "1.25 microseconds on an AGP 4x bus" in said.why and "114 million a second" in said.why


def test_figure_17_says_which_depth_was_chosen(tmp_path: Path) -> None:
    for scene, options, overhead in (("bunny", {}, 3.2), ("conference", {}, 1.0),
                                     ("conference", {"max_depth": 34}, 2.9)):
        write_cell(fig17.cell(scene, **options), tmp_path, tree={
            "overhead": overhead, "depth": options.get("max_depth", 28), "leaves": 1_000_000})
    said = fig17.judge(tmp_path, False)
    assert (said.word, said.scenes, said.claims) == (
        verdicts.REPRODUCED, ("bunny", "conference"), 2)
    assert "(depth 28, the default; 2.86 times the published leaves)" in said.why
    assert "(depth 34, chosen; 0.8 times the published leaves)" in said.why
