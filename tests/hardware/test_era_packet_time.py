"""Tests of predicted times: how long packets traced here would have taken on a card with loops."""
from __future__ import annotations

import pytest

import gpgpu_rt as rt
from gpgpu_rt.errors import OptionError
from gpgpu_rt.hardware import era_packet_time, era_rays, packet_trace
from gpgpu_rt.hardware.cards import find_card
from gpgpu_rt.hardware.era_time import era_timed
from gpgpu_rt.hardware.issue import GROUPS, WHILE_WHILE, WITHIN, issued_in_loop
from gpgpu_rt.hardware.loop_costs import setup_slots
from gpgpu_rt.hardware.machine_model import time_of_loop
from gpgpu_rt.hardware.static_costs import static_cost
from gpgpu_rt.hardware.trace import record_trace
from gpgpu_rt.scene.loading import load_scene

SIZE = (40, 56)     # width and height of the image
HORN = {"push_down": True, "stack_size": 3, "skip_empty_leaves": False}


def _predicted(scene: rt.Scene, *calls: str, size=SIZE, **more) -> float:
    """Returns the seconds that `era_timed` predicts for the ``calls`` of a tracer."""
    rays = scene.camera.rays(size)
    with rt.Tracer(scene, "kd-packet", era="r580", **more) as tracer:
        with era_timed(tracer) as seen:
            for call in calls:
                getattr(tracer, call)(*rays)
        card, time = seen.on_card()
    assert card.chip == "R580"
    return time.seconds


def _from_trace(scene: rt.Scene, call: str) -> float:
    """Returns the seconds that follow from a recorded trace of the same packets."""
    rays, card, any_hit = scene.camera.rays(SIZE), find_card("R580"), call == "occluded"
    with rt.Tracer(scene, "kd-packet", schedule="step", intersection="moller-trumbore",
                   **HORN) as tracer:
        trace = packet_trace.in_loop(record_trace(
            tracer, rays[0].shape[:2], lambda: getattr(tracer, call)(*rays),
            packet_trace.fields_of(True)), True)
    issued = issued_in_loop(trace, GROUPS["R580"], WHILE_WHILE, WITHIN)
    costs = {name: static_cost("r580", "kd-packet", name, any_hit, True, **HORN)
             for name in trace.kernels}
    streams = {name: era_packet_time.stream_fetches("kd-packet", name, any_hit, **HORN)
               for name in trace.kernels}
    # The instructions outside the kernels run once for the four rays of a packet.
    whole = static_cost("r580", "kd-packet", "loop", any_hit, True, **HORN).arithmetic
    setup = (whole - sum(cost.arithmetic for cost in costs.values())) / 4
    assert setup_slots("r580", "kd-packet", any_hit, **HORN) == setup > 20
    return time_of_loop(card, issued, costs, streams, SIZE[0] * SIZE[1], setup=setup).seconds


@pytest.mark.parametrize("calls", [("trace",), ("occluded",), ("trace", "occluded")], ids=str)
def test_each_pass_takes_the_time_of_its_kernels(calls) -> None:
    scene = load_scene("shirley6")
    assert _predicted(scene, *calls) == pytest.approx(
        sum(_from_trace(scene, call) for call in calls), rel=1e-6)


def test_a_large_image_is_sampled(monkeypatch) -> None:
    scene = load_scene("shirley6")
    whole = _predicted(scene, "trace", size=(192, 192))
    monkeypatch.setattr(era_rays, "TILE", 24)
    traced = []
    trace = era_rays.record_trace
    monkeypatch.setattr(era_rays, "record_trace",
                        lambda tracer, size, *more: traced.append(size) or trace(
                            tracer, size, *more))
    assert _predicted(scene, "trace", size=(192, 192)) == pytest.approx(whole, rel=0.3)
    assert traced == [(96, 96)]     # tiles of 24x24 packets of 2x2 rays


def test_packets_that_were_not_compiled_get_no_time() -> None:
    with pytest.raises(OptionError, match="was not compiled for r580"):
        _predicted(load_scene("cornell"), "trace", push_down=False, stack_size=3)
