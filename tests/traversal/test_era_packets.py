"""The packets of the era form find the same triangles as today's packets. The tests run a program
that contains all kernels in a loop, as on a card with branches: the whole program."""
from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

import gpgpu_rt as rt
from gpgpu_rt.errors import OptionError
from gpgpu_rt.gl.full_screen import FullScreenPass
from gpgpu_rt.gl.shader import ROOT
from gpgpu_rt.gl.target import Target
from gpgpu_rt.hardware import packet_trace
from gpgpu_rt.hardware.trace import record_trace
from gpgpu_rt.inspect.program_text import program_text
from gpgpu_rt.methods import find_method
from gpgpu_rt.options import ERA_TARGETS
from gpgpu_rt.scene.loading import load_scene
from gpgpu_rt.traversal.era import TESTS_TRIANGLES, EraTraversal
from gpgpu_rt.traversal.era_packets import HITS, packet_kernels, packet_loop

SIDE = 64
PACKET = find_method("kd-packet")
KERNELS = ("begin", "traverse", "push", "intersect", "leave", "pop")
HORN = [{"push_down": down, "stack_size": size} for down, size in (
    (False, 0), (True, 0), (True, 3), (False, 3))]


def _resolved(**more: Any) -> dict[str, Any]:
    return PACKET.resolved({"skip_empty_leaves": False, **more})


def _traced(monkeypatch, scene: rt.Scene, rays, any_hit: bool = False, text: str = "",
            **more: Any) -> dict[str, np.ndarray]:
    """Returns the hits of the whole program, image row by image row. The tables and the rays are
    those of kd-restart in the era form, which has the same tree.

    ``text`` replaces glsl/era/packet_loop.glsl.
    """
    kept = []

    def run(self, rays, buffers, statistics, any_hit=False):
        rays_of_era = self._generated(rays, statistics)
        found = packet_loop(PACKET, _resolved(**more), any_hit)
        virtual = {**found.virtual, **({"pass": text} if text else {})}
        program = FullScreenPass(self.gpu, "era/renderer.frag", found.defines, virtual)
        width, height = rays_of_era.size
        program.set(**self.uniforms(), rays_texel_size=(1 / width, 1 / height))
        target = Target(self.gpu, HITS, (width // 2, height // 2))
        self.draw(program, target, {**self.samplers, **rays_of_era.samplers()}, statistics)
        fields = {name: values.reshape(height // 2, width // 2, 2, 2)
                  .transpose(0, 2, 1, 3).reshape(-1) for name, values in target.fields().items()}
        kept.append(fields)
        return traced(self, rays, buffers, statistics, any_hit)
    traced = EraTraversal.run
    monkeypatch.setattr(EraTraversal, "run", run)
    with rt.Tracer(scene, "kd-restart", era="r580") as tracer:
        (tracer.occluded if any_hit else tracer.trace)(*rays)
    return kept[0]


@pytest.mark.parametrize("more", HORN, ids=str)
@pytest.mark.parametrize("name", ["cornell", "shirley6"])
def test_the_loop_finds_the_same_triangles(monkeypatch, name, more):
    scene = load_scene(name)
    rays = scene.camera.rays((SIDE, SIDE))
    found = _traced(monkeypatch, scene, rays, **more)
    with rt.Tracer(scene, "kd-packet", intersection="moller-trumbore", skip_empty_leaves=False,
                   **more) as tracer:
        today = tracer.trace(*rays)
    hit = today.triangle >= 0
    assert hit.sum() > SIDE * SIDE / 10
    triangle = np.where(found["triangle"] == 1 << 24, -1, found["triangle"])
    assert (triangle != today.triangle).sum() <= SIDE * SIDE / 1e3
    same = (triangle == today.triangle) & hit
    np.testing.assert_array_equal(found["t"][same], today.t[same])


def test_rays_of_all_directions_take_turns(monkeypatch):
    """Each packet has rays of several octants, as after a bounce."""
    scene, rng = load_scene("cornell"), np.random.default_rng(5)
    middle = np.mean(scene.bounds, axis=0)
    rays = np.broadcast_to(middle, (SIDE * SIDE, 3)), rng.normal(size=(SIDE * SIDE, 3))
    for any_hit in (False, True):
        found = _traced(monkeypatch, scene, rays, any_hit, stack_size=3)
        with rt.Tracer(scene, "kd-packet", intersection="moller-trumbore") as tracer:
            hit = tracer.occluded(*rays) if any_hit else tracer.trace(*rays).hit
        assert hit.sum() > SIDE * SIDE / 10
        assert ((found["triangle"] != 1 << 24) != hit).sum() <= SIDE * SIDE / 1e3


def _counting() -> str:
    """Returns the whole program with its hits replaced by the number of runs of each kernel."""
    text = (ROOT / "era" / "packet_loop.glsl").read_text()
    text = re.sub(r"( +)(\w+)(\(rays, state, hit\);)", r"\1\2\3\n\1++count_\2;", text)
    text = text.replace("void main", "".join(f"float count_{name} = 0.0;\n" for name in KERNELS)
                        + "void main")
    return text.replace("hit_store(hit);", "hit_store(Hit("
                        "vec4(count_begin, count_traverse, count_push, count_intersect), "
                        "vec4(count_leave, count_pop, 0.0, 0.0), ZERO, ZERO));")


@pytest.mark.parametrize("more", HORN, ids=str)
@pytest.mark.parametrize("any_hit", [False, True])
def test_the_loop_runs_the_kernels_of_the_trace(monkeypatch, more, any_hit):
    """The predictions count the kernels that each packet really runs."""
    scene = load_scene("shirley6")
    rays = scene.camera.rays((SIDE, SIDE))
    found = _traced(monkeypatch, scene, rays, any_hit, _counting(), **more)
    ran = np.stack([found["t"], found["u"]]).reshape(2, SIDE // 2, 2, SIDE // 2, 2)
    ran = ran.transpose(0, 2, 4, 1, 3).reshape(8, SIDE // 2, SIDE // 2)
    stack = bool(more["stack_size"])
    with rt.Tracer(scene, "kd-packet", schedule="step", intersection="moller-trumbore",
                   skip_empty_leaves=False, **more) as tracer:
        trace = packet_trace.in_loop(record_trace(
            tracer, (SIDE, SIDE), lambda: (tracer.occluded if any_hit else tracer.trace)(*rays),
            packet_trace.fields_of(stack)), stack)
    for runs, name in zip(ran, KERNELS):
        if name in trace.kernels:
            assert (trace.runs(name) != runs).mean() <= 2e-3, name
            assert runs.any()
    assert len(trace.kernels) == len(KERNELS) - (not stack)


@pytest.mark.parametrize("more", HORN, ids=str)
def test_a_kernel_writes_what_it_changes(more):
    """Each kernel assigns every field that it is said to change, and fits a card's targets."""
    for any_hit in (False, True):
        for kernel in packet_kernels(PACKET, _resolved(**more), any_hit):
            text = program_text(kernel.source("card"))
            assert text.startswith("#version 120\n")
            assert 1 <= text.count("TARGET(") - 1 <= ERA_TARGETS
            assert ("hit_store(" in text) == (kernel.name == TESTS_TRIANGLES)
            changed = PACKET.era_packets.changes(_resolved(**more))[kernel.name]
            for field in re.findall(r"(\w+):", changed):
                assert re.search(rf"state\.{field}\s*(=|\+=)[^=]", text) or (
                    field == "place" and re.search(r"state\.(node|cursor) (=|\+=) ", text)), field


@pytest.mark.parametrize("more", [{"packet": (4, 2)}, {"skip_empty_leaves": True},
                                  {"stack_size": 2}], ids=str)
def test_other_packets_are_refused(more):
    name = next(iter(more))
    with pytest.raises(OptionError, match=f"kd-packet with {name}=.* has no era form"):
        packet_kernels(PACKET, _resolved(**more))
