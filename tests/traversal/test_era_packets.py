"""Packets in the era form (docs/era.md) find the same triangles as today's packets. The tests run
the whole program, which holds all kernels in one loop, as a card with branches would run it."""
from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import gpgpu_rt as rt
from gpgpu_rt.errors import LimitError, OptionError
from gpgpu_rt.gl.shader import ROOT
from gpgpu_rt.hardware import packet_trace
from gpgpu_rt.hardware.cards import find_card
from gpgpu_rt.hardware.trace import record_trace
from gpgpu_rt.inspect.program_text import program_text
from gpgpu_rt.methods import find_method
from gpgpu_rt.options import ERA_LOOPS, ERA_TARGETS, ERAS
from gpgpu_rt.scene.loading import load_scene
from gpgpu_rt.traversal import era_packets
from gpgpu_rt.traversal.era import TESTS_TRIANGLES
from gpgpu_rt.traversal.era_packets import LOOP, packet_kernels, packet_loop

SIDE = 64
PACKET = find_method("kd-packet")
KERNELS = ("begin", "traverse", "push", "intersect", "leave", "pop")
# The variants of Horn et al. 2007: restart, push-down, short stack with push-down, short stack.
HORN = [{"push_down": down, "stack_size": size} for down, size in (
    (False, 0), (True, 0), (True, 3), (False, 3))]


def _resolved(**more: Any) -> dict[str, Any]:
    return PACKET.resolved({"skip_empty_leaves": False, **more})


@pytest.fixture(scope="module")
def scenes() -> dict[str, rt.Scene]:
    return {name: load_scene(name) for name in ("cornell", "shirley6")}


@pytest.mark.parametrize("era", ERA_LOOPS)
@pytest.mark.parametrize("more", HORN, ids=str)
@pytest.mark.parametrize("name", ["cornell", "shirley6"])
def test_the_loop_finds_the_same_triangles(scenes, name, more, era):
    scene = scenes[name]
    rays = scene.camera.rays((SIDE, SIDE))
    with rt.Tracer(scene, "kd-packet", intersection="moller-trumbore", skip_empty_leaves=False,
                   **more) as tracer:
        today = tracer.trace(*rays)
    with rt.Tracer(scene, "kd-packet", era=era, **more) as tracer:
        found = tracer.trace(*rays)
    assert today.hit.sum() > SIDE * SIDE / 10
    assert (found.triangle != today.triangle).sum() <= SIDE * SIDE / 1e4
    same = (found.triangle == today.triangle) & today.hit
    np.testing.assert_array_equal(found.t[same], today.t[same])
    assert not found.status.any()


@pytest.mark.parametrize("shape", [(1, 1), (7, 5), (33, 64)])
def test_images_of_odd_sizes(scenes, shape):
    rays = scenes["cornell"].camera.rays(shape)
    with rt.Tracer(scenes["cornell"], "kd-packet", intersection="moller-trumbore") as tracer:
        today = tracer.trace(*rays)
    with rt.Tracer(scenes["cornell"], "kd-packet", era="r580") as tracer:
        np.testing.assert_array_equal(tracer.trace(*rays).triangle, today.triangle)


def test_rays_of_all_directions_take_turns(scenes):
    """Each packet has rays of several octants, as after a bounce. Some directions have a zero
    component."""
    scene, rng = scenes["cornell"], np.random.default_rng(5)
    middle = np.mean(scene.bounds, axis=0)
    directions = rng.normal(size=(SIDE * SIDE, 3))
    directions[::7, 1] = 0
    rays = np.broadcast_to(middle, directions.shape), directions
    with rt.Tracer(scene, "kd-packet", intersection="moller-trumbore") as tracer:
        nearest = tracer.trace(*rays)
        end = float(np.median(nearest.t[nearest.hit]))
        hit = tracer.occluded(*rays, end)
    with rt.Tracer(scene, "kd-packet", era="r580") as tracer:
        found, any_hit = tracer.trace(*rays), tracer.occluded(*rays, end)
    assert SIDE * SIDE / 10 < hit.sum() < nearest.hit.sum()
    assert (found.triangle != nearest.triangle).sum() <= SIDE * SIDE / 1e3
    assert (any_hit != hit).sum() <= SIDE * SIDE / 1e3


def test_moved_triangles_are_followed():
    moving = rt.load_animation("cloth")
    rays = moving.scene.camera.rays((SIDE, SIDE))
    found = {}
    for era in (None, "r580"):
        more = {"era": era} if era else {"intersection": "moller-trumbore"}
        with rt.Tracer(moving.scene, "kd-packet", **more) as tracer:
            tracer.trace(*rays)
            tracer.update(moving.vertices(12))
            found[era] = tracer.trace(*rays)
    assert (found[None].triangle != found["r580"].triangle).sum() <= 1
    assert found[None].hit.any()


def test_a_loop_that_the_renderer_ends_early_is_an_error(scenes, monkeypatch):
    """A renderer may end a very long loop. No known scene has such a loop, so the test cuts the
    loop short."""
    def cut_short(*given):
        found = packet_loop(*given)
        text = (ROOT / "era" / "packet_loop.glsl").read_text()
        cut = text.replace("while (state.phase != DONE)", "for (int i = 0.0; i < 3.0; ++i)")
        assert cut != text
        return replace(found, virtual={**found.virtual, "pass": cut})
    monkeypatch.setattr(era_packets, "packet_loop", cut_short)
    with rt.Tracer(scenes["cornell"], "kd-packet", era="r580") as tracer:
        with pytest.raises(LimitError, match="ended the loop of a packet early"):
            tracer.trace(*scenes["cornell"].camera.rays((SIDE, SIDE)))


def _counting() -> str:
    """Returns the whole program, changed to write each kernel's number of runs instead of hits."""
    text = (ROOT / "era" / "packet_loop.glsl").read_text()
    text = re.sub(r"( +)(\w+)(\(rays, state, hit\);)", r"\1\2\3\n\1++count_\2;", text)
    text = text.replace("void main", "".join(f"float count_{name} = 0.0;\n" for name in KERNELS)
                        + "void main")
    return text.replace("hit_store(hit);", "hit_store(Hit("
                        "vec4(count_begin, count_traverse, count_push, count_intersect), "
                        "vec4(count_leave, count_pop, 0.0, 0.0), ZERO, ZERO));")


@pytest.mark.parametrize("more", HORN, ids=str)
@pytest.mark.parametrize("any_hit", [False, True])
def test_the_loop_runs_the_kernels_of_the_trace(scenes, monkeypatch, more, any_hit):
    """A trace under `step` predicts how often each packet runs each kernel. The loop runs the
    kernels this often, except in a few packets."""
    def counting(*given):
        found = packet_loop(*given)
        return replace(found, virtual={**found.virtual, "pass": _counting()})
    counted = []

    def look(one):
        if one.kernel == LOOP:
            counted.append(one.target.fields("packet"))
    rays = scenes["shirley6"].camera.rays((SIDE, SIDE))
    with monkeypatch.context() as patch:
        patch.setattr(era_packets, "packet_loop", counting)
        with rt.Tracer(scenes["shirley6"], "kd-packet", era="r580", **more) as tracer:
            with tracer.observe(look):
                (tracer.occluded if any_hit else tracer.trace)(*rays)
    ran = np.concatenate([counted[0]["t"], counted[0]["u"]], axis=1)
    ran = ran.T.reshape(8, SIDE // 2, SIDE // 2)
    stack = bool(more["stack_size"])
    with rt.Tracer(scenes["shirley6"], "kd-packet", schedule="step",
                   intersection="moller-trumbore", skip_empty_leaves=False, **more) as tracer:
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
    """Each kernel assigns every field that the method declares for the kernel. The fields fit a
    card's render targets."""
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
def test_other_packets_are_refused(scenes, more):
    name = next(iter(more))
    with pytest.raises(OptionError, match=f"kd-packet with {name}=.* has no era form"):
        packet_kernels(PACKET, _resolved(**more))
    with pytest.raises(OptionError, match=f"era=r580 implies|{name}=.* has no era form"):
        rt.Tracer(scenes["cornell"], "kd-packet", era="r580", **more)


@pytest.mark.parametrize("era", sorted(set(ERAS) - set(ERA_LOOPS)))
def test_cards_without_loops_are_refused(scenes, era):
    assert not find_card(era.upper()).branching
    with pytest.raises(OptionError, match="no loops; give era=nv40 or era=r580"):
        rt.Tracer(scenes["cornell"], "kd-packet", era=era)
    assert all(find_card(chip.upper()).branching for chip in ERA_LOOPS)
