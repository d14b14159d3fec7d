"""The emulated fragment processor produces the renderer's bits and the shaders' own counters."""
from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from traces import kernel_traces, modelled

import gpgpu_rt as rt
from gpgpu_rt.errors import ShaderError
from gpgpu_rt.hardware import compiler
from gpgpu_rt.hardware.compiler import compiled
from gpgpu_rt.hardware.counters import counted, pass_counts
from gpgpu_rt.hardware.emulate import texels_along_morton
from gpgpu_rt.hardware.program import parse
from gpgpu_rt.hardware.sample import emulated, tile_pixels
from gpgpu_rt.hardware.translate import translate
from gpgpu_rt.traversal.method import SCHEDULES

TILE = (16, 8)
needs_counts = pytest.mark.usefixtures("countable")
MANY = [("kd-restart", {}), ("kd-packet", {}), ("bvh-packet", {}), ("grid", {"resolution": 2}),
        ("kd-stack", {}), ("geometry-image", {}), ("bvh-threaded", {"quantise_nodes": 16})]
MORE = [("brute-force", {}), ("grid-proximity", {}), ("kd-backtrack", {}), ("kd-push-down", {}),
        ("kd-short-stack", {}), ("kd-ropes", {}), ("kd-ropes-packet", {}), ("bvh-threaded", {}),
        ("bvh-threaded", {"octants": True}), ("bih", {}), ("visibility-field", {}),
        ("kd-restart", {"precision": "fp24"}), ("bvh-stack", {"quantise_nodes": 8}),
        ("bvh-packet", {"octants": True, "quantise_nodes": 16, "interval_test": True}),
        ("bvh-packet", {"entry_points": 8}), ("bvh-packet", {"octants": True, "entry_points": 8})]


def _case(method: str, options: dict, marks: list) -> object:
    words = " ".join(f"{name}={value}" for name, value in options.items())
    return pytest.param(method, options, id=f"{method} {words} seed 5".strip(), marks=marks)


CASES = [_case(*one, []) for one in MANY] + [_case(*one, [pytest.mark.full]) for one in MORE]


def _rays(scene: rt.Scene) -> tuple[np.ndarray, np.ndarray]:
    """Returns two tiles of rays. Each ray has its own origin, so the origins are in a texture."""
    pixels = tile_pixels(64, TILE, (2, 1))
    origins, directions = (a.reshape(-1, 3)[pixels] for a in scene.camera.rays((64, 64)))
    aside = np.random.default_rng(5).normal(scale=1e-3, size=origins.shape)
    return origins + aside.astype(np.float32), directions


@needs_counts
@pytest.mark.parametrize("method, options", CASES)
def test_the_emulation_leaves_what_the_renderer_left(method: str, options: dict) -> None:
    scene = rt.load_scene("cornell")
    with rt.Tracer(scene, method, **options) as tracer:
        run, watch = emulated(tracer, *_rays(scene), tile=TILE)
        drawn = {texture: _name(texture, tracer.method.packet or method == "bvh-stack")
                 for texture in range(len(watch.results()))}
        width, height = tracer.options.get("packet", (1, 1)) if tracer.method.packet else (1, 1)
        part = TILE[0] // width, TILE[1] // height
        places = np.concatenate([texels_along_morton(*part) + (part[0] * at, 0)
                                for at in range(2)])
        for target, image in enumerate(watch.results()):
            left = image[places[:, 1], places[:, 0]].view(np.uint32)
            mine = [name for name in run.outputs if name == drawn[target]] or [
                name for name, at in run.program.outputs.items() if at == target]
            found = run.outputs[mine[0]][:, :left.shape[1]].view(np.uint32)
            assert np.array_equal(left, found)


def _name(target: int, packet: bool) -> str:
    """Returns the compiler's name of an element of an output array."""
    return ("packet_target" if target == 0 else f"packet_target@{target - 1}") if packet else ""


QUICK = ("kd-restart", "bih")
STEPWISE = [row.name for row in rt.methods() if row.schedules == SCHEDULES]


@needs_counts
@pytest.mark.parametrize("method", [
    pytest.param(name, id=f"{name} seed 5", marks=[] if name in QUICK else [pytest.mark.full])
    for name in STEPWISE])
def test_the_static_model_agrees_with_the_instrumented_run(method: str) -> None:
    scene = rt.load_scene("cornell")
    rays = _rays(scene)
    with rt.Tracer(scene, method, schedule="step", statistics=True) as tracer:
        traces = kernel_traces(tracer, *rays)
        hits = tracer.trace(*rays)
        steps = tracer.statistics.counters["steps"]
    with rt.Tracer(scene, method) as tracer:
        run, _ = emulated(tracer, *rays, tile=TILE)
    assert sum(traces.runs) == pytest.approx(steps * len(hits))
    assert traces.turns == run.runs[1][run.program.loops[0]]
    model, ran = modelled(run.program, traces), run.predicated()
    assert model.vector == pytest.approx(ran.vector, rel=0.02)
    assert model.scalar == pytest.approx(ran.scalar, rel=0.02)
    assert run.fetches().get("triangle_table", 0) == (
        0 if method == "geometry-image" else 3 * hits.triangles_tested.sum())


@needs_counts
def test_groups_run_what_any_of_them_wants() -> None:
    scene = rt.load_scene("cornell")
    with rt.Tracer(scene, "kd-restart") as tracer:
        run, _ = emulated(tracer, *_rays(scene), tile=TILE, widths=(1, 8, 64, 256))
    lanes = [run.instructions(True, width) for width in (1, 8, 64, 256)]
    assert lanes == sorted(lanes) and lanes[0] < lanes[-1]
    assert [run.runs[width][0] for width in (1, 8, 64, 256)] == [256, 32, 4, 1]


@pytest.mark.parametrize("schedule", ["kernels", "step", "loop"])
def test_the_log_of_passes_counts_what_ran(schedule: str) -> None:
    scene = rt.load_scene("cornell")
    with rt.Tracer(scene, "kd-restart", schedule=schedule, statistics=True) as tracer:
        hits = tracer.trace(*_rays(scene))
        cost, log = tracer.statistics, tracer.pass_log
        steps = cost.counters["steps"] * len(hits)
    assert sum(one["draws"] for one in cost.pass_log) == cost.draw_calls
    assert cost.uploaded_bytes >= 32 * len(hits)  # the rays, and the draws' vertices
    assert log is not None and log.queries == cost.queries
    ran = {one["name"]: one for one in cost.pass_log}
    if schedule == "kernels":
        assert ran["down"]["fragments"] + ran["intersect"]["fragments"] >= steps
        assert ran["down"]["written"] == ran["down"]["fragments"] * 4 * 16
    else:
        assert ran["drivers/traverse.frag"]["written"] > 0


@needs_counts
def test_passes_have_operations_and_fetches() -> None:
    scene = rt.load_scene("cornell")
    with rt.Tracer(scene, "kd-restart", schedule="kernels", statistics=True) as tracer:
        tracer.trace(*_rays(scene))
        assert tracer.pass_log is not None
        passes = {one["name"]: one for one in pass_counts(tracer.pass_log)}
    assert passes["down"]["once"]["fetches"]["kd_node_table"] == 1
    assert passes["intersect"]["once"]["fetches"]["triangle_table"] == 3
    total = passes["intersect"]["total"]
    assert total["fetches"]["triangle_table"] == 3 * passes["intersect"]["fragments"]
    assert total["vector"] == passes["intersect"]["once"]["vector"] * passes["intersect"][
        "fragments"] > 0


PAIRS = [(row.name, schedule) for row in rt.methods() for schedule in row.schedules]
SOME = (("bvh-packet", "loop"), ("ray-tiles", "kernels"))
# Not counted: a vertex program with a loop places the lines of this pass, and loops in vertex
# programs are not emulated.
UNSEEN = {"algorithms/segments.frag"}


@needs_counts
@pytest.mark.parametrize("method, schedule", [
    pytest.param(*pair, id=f"{pair[0]} {pair[1]} seed 5",
                 marks=[] if pair in SOME else [pytest.mark.full]) for pair in PAIRS])
def test_every_pass_of_every_method_is_counted(method: str, schedule: str) -> None:
    scene = rt.load_scene("cornell")
    origins, directions = (a[:, :16] for a in _rays(scene))
    with rt.Tracer(scene, method, schedule=schedule) as tracer:
        passes, log = counted(tracer, lambda: tracer.trace(origins, directions))
        cost = tracer.statistics
    assert {one["name"] for one in passes if "total" not in one} <= UNSEEN
    assert sum(one["draws"] for one in passes) >= cost.draw_calls > 0
    assert log.queries == cost.queries
    assert log.uploaded >= 32 * 128 and log.read_back >= 16 * 128  # rays, hits
    for one in passes:
        assert one["fragments"] >= 0 and one["written"] >= 0
        assert set(one["once"]["fetches"]) <= set(one["texel_bytes"])
        if "wanted" in one:  # at most the fetches of a run through both sides of all branches
            assert all(count <= one["total"]["fetches"][name]
                       for name, count in one["wanted"].items())
    if schedule != "loop" or method == "geometry-image":
        return
    with rt.Tracer(scene, method, statistics=True) as tracer:  # the shaders' own counters
        hits = tracer.trace(origins, directions)
        side = tracer.options.get("packet", (1, 1)) if tracer.method.packet else (1, 1)
    fetched = sum(one["wanted"].get("triangle_table", 0) for one in passes if "wanted" in one)
    # Each of the k rays of a packet stores the packet's counters, which count a fetched triangle k
    # times. The sum over all rays is therefore divided by k^2.
    tested = hits.triangles_tested.sum() / (side[0] * side[1]) ** 2
    assert fetched == pytest.approx(3 * tested, rel=0.02)


def test_counting_the_counters_is_refused() -> None:
    with rt.Tracer(rt.load_scene("cornell"), "kd-restart", statistics=True) as tracer:
        with pytest.raises(rt.Error, match="counted, too"):
            counted(tracer, lambda: None)


def test_without_statistics_nothing_is_logged() -> None:
    scene = rt.load_scene("cornell")
    with rt.Tracer(scene, "kd-restart") as tracer:
        tracer.trace(*_rays(scene))
        assert not tracer.gpu.observers and tracer.pass_log is None
        assert tracer.statistics.pass_log == [] and tracer.statistics.uploaded_bytes == 0


@needs_counts
def test_an_instruction_that_is_not_emulated_is_named() -> None:
    text, = compiled([("#version 330\nin vec2 p; void main() { gl_Position = vec4(p, 0, 1); }",
                       "#version 330\nuniform vec4 a; out vec4 colour;\n"
                       "void main() { colour = vec4(sin(a.x)); }")])
    with pytest.raises(ShaderError, match="fsin cannot be emulated.*hardware/translate.py$"):
        translate(parse(text))


@needs_counts
def test_the_compiler_outlives_a_text_that_it_refuses() -> None:
    vertex = "#version 330\nin vec2 corner;\nvoid main() { gl_Position = vec4(corner, 0, 1); }\n"
    fragment = "#version 330\nout vec4 colour;\nvoid main() { colour = vec4(%s); }\n"
    whole = vertex, fragment % "1"
    work = parse(*compiled([whole])).work
    with pytest.raises(ShaderError, match="no instruction counts.*Mesa") as refused:
        compiled([whole, (vertex, fragment % "no_such_name")])
    assert "\n" not in str(refused.value)
    assert [parse(text).work for text in compiled([whole, whole])] == [work, work]


@needs_counts
def test_the_compiler_outlives_an_interrupt(monkeypatch) -> None:
    """After an interrupt, the compiler process must not answer the next request with the old
    text."""
    vertex = "#version 330\nin vec2 corner;\nvoid main() { gl_Position = vec4(corner, 0, 1); }\n"
    one, other = ((vertex, "#version 330\nuniform vec4 a; out vec4 colour;\n"
                   f"void main() {{ colour = {what}; }}\n") for what in ("a", "a * a + a"))
    expected = [parse(*compiled([text])).work for text in (one, other)]
    assert expected[0] != expected[1]

    class Interrupting(str):
        def __eq__(self, line: object) -> bool:
            raise KeyboardInterrupt
    monkeypatch.setattr(compiler, "_END", Interrupting(compiler._END))
    with pytest.raises(KeyboardInterrupt):
        compiled([one])
    monkeypatch.undo()
    assert [parse(*compiled([text])).work for text in (other, one)] == expected[::-1]


@needs_counts
def test_threads_ask_the_compiler_in_turns() -> None:
    vertex = "#version 330\nin vec2 corner;\nvoid main() { gl_Position = vec4(corner, 0, 1); }\n"
    texts = [(vertex, "#version 330\nuniform vec4 a; out vec4 colour;\n"
              f"void main() {{ colour = {' + '.join(['a * a'] * k)}; }}\n") for k in range(1, 7)]
    alone = [parse(*compiled([text])).work for text in texts]
    assert alone[0] != alone[-1]
    with ThreadPoolExecutor(3) as pool:
        found = [parse(text).work for [text] in pool.map(lambda text: compiled([text]), texts)]
    assert found == alone
