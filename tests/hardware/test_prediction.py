"""Predicted times: users, figures and `render --era` get the same time for the same rays."""
from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from itertools import product

import numpy as np
import pytest

import gpgpu_rt as rt
from gpgpu_rt.bench.workloads import RAY_SETS, Workload, rays_of, workload
from gpgpu_rt.cli import card_predictions
from gpgpu_rt.cli.main import main
from gpgpu_rt.errors import OptionError
from gpgpu_rt.figures.framework.predicted_times import PredictedRow
from gpgpu_rt.figures.survey import fig20_whole_images as fig20
from gpgpu_rt.hardware import era_rays, image_issues, packet_trace
from gpgpu_rt.hardware.cards import find_card
from gpgpu_rt.hardware.era_time import era_timed
from gpgpu_rt.hardware.issue import (
    GROUPS, STEP, WHILE_WHILE, WITHIN, issued_in_loop, issued_in_passes
)
from gpgpu_rt.hardware.loop_costs import setup_slots
from gpgpu_rt.hardware.machine_model import stream_fetches, time_of_loop, time_of_passes
from gpgpu_rt.hardware.prediction import limit_of, predict, why_no_time
from gpgpu_rt.hardware.program_forms import FORMS, MEANINGS, PASSES, SINGLE_RAYS, forms_of
from gpgpu_rt.hardware.static_costs import era_programs, static_cost
from gpgpu_rt.hardware.trace import record_trace
from gpgpu_rt.methods import built_in_methods, find_method
from gpgpu_rt.text_format import number

HORN = {"push_down": True, "stack_size": 3, "skip_empty_leaves": False}


@pytest.mark.parametrize("chip", FORMS)
@pytest.mark.parametrize("method", [row.name for row in rt.methods()])
def test_every_method_has_a_time_or_a_reason(method: str, chip: str) -> None:
    scene = rt.load_scene("cornell")
    forms = forms_of(method, chip)
    try:
        found = predict(scene, method, chip.lower(), size=16)
    except OptionError as reason:
        assert method in str(reason) and find_card(chip).name in str(reason)
        assert "\n" not in str(reason)
        if limit := limit_of(find_card(chip), method):
            says = f"could not have run method {method}, which {limit.says}"
        elif find_method(method) not in built_in_methods():
            says = "no costs were compiled for a method of your own"
        else:
            says = why_no_time(method)
            assert says and not forms
        assert says in str(reason)
        return
    assert found.form == forms[0] and found.form in MEANINGS
    assert found.seconds == sum(found.parts.values()) > 0
    assert (found.count, found.size, found.rays) == (16 * 16, 16, "eye rays")
    assert "16x16 pixels" in str(found)


@pytest.mark.parametrize("name", [row.name for row in built_in_methods()
                                  if row.name in SINGLE_RAYS and row.why_no_era_form()])
def test_a_packet_method_says_which_cards_can_run_its_packets(name: str) -> None:
    assert why_no_time(name) == (
        "no kernels that trace packets of its rays were written for the papers' cards; on the "
        f"G80, each lane of a warp runs the kernels of {SINGLE_RAYS[name]} for a ray of a packet")


@pytest.mark.parametrize("chip", FORMS)
def test_a_stack_needs_a_local_array_or_a_pass_for_each_push(chip: str) -> None:
    """Only the G80 can index a local array. A stack in a texture needs a pass after each push."""
    loops = {form for form in forms_of("kd-restart", chip) if form != PASSES}
    assert set(forms_of("kd-stack", chip)) == (loops if chip == "G80" else set())
    passes = {form for form in FORMS[chip] if form == PASSES}
    assert set(forms_of("kd-texture-stack", chip)) == passes


@pytest.mark.parametrize("kind", RAY_SETS)
def test_the_number_of_rays_is_not_a_guess(kind: str) -> None:
    """A prediction traces a sample of the rays, but its ``count`` is the number of all rays."""
    scene = rt.load_scene("cornell")
    rays = rays_of(scene, RAY_SETS[kind], 150)
    found = predict(scene, "brute-force", "nv40", kind, size=150)
    assert found.count == rays.live and f"{rays.live:,} {kind} rays of" in str(found)


def test_the_command_prints_a_table(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["hardware", "--predict", "all", "--rays", "shadow", "--size", "16"]
    assert main(words) == 0
    heads, _, *lines = capsys.readouterr().out.splitlines()[1:]
    assert heads.split()[1:] == list(FORMS)
    lines = {line.split()[0]: re.split("  +", line)[1:] for line in lines if line}
    assert main([*words, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    rays = rays_of(rt.load_scene("cornell"), RAY_SETS["shadow"], 16)
    assert (found["scene"], found["rays"], found["count"]) == ("cornell", "shadow", rays.live)
    for at, (one, (row, chip)) in enumerate(zip(found["predictions"],
                                                product(rt.methods(), FORMS), strict=True)):
        assert (one["method"], one["card"]) == (row.name, find_card(chip).name)
        cell = lines[row.name][at % len(FORMS)]
        if "seconds" in one:
            assert cell == number(1e3 * one["seconds"])
            assert one["seconds"] == predict(rt.load_scene("cornell"), row.name, chip,
                                             rays).seconds
        elif limit := limit_of(find_card(chip), row.name):
            assert cell == f"cannot run: {limit.limit}" and one["reason"] == limit.says
        else:
            assert cell == "-" and why_no_time(row.name) in one["reason"]


def test_rows_are_printed_as_soon_as_they_are_ready(capsys, monkeypatch) -> None:
    """An interrupt loses no row that is ready. Only the cards of --card are computed."""
    words = ["hardware", "--predict", "grid,kd-restart", "--size", "16", "--card", "g80,NV40"]
    computed = []

    def interrupted(scene, method, chip, rays):
        if method == "kd-restart" and chip == "G80":
            raise KeyboardInterrupt
        computed.append((method, chip))
        return predict(scene, method, chip, rays)
    monkeypatch.setattr(card_predictions, "predict", interrupted)
    assert main(words) == 130
    _, heads, _, *rows = capsys.readouterr().out.splitlines()
    assert heads.split()[1:] == ["NV40", "G80"] and [row.split()[0] for row in rows] == ["grid"]
    assert computed == [("grid", "NV40"), ("grid", "G80"), ("kd-restart", "NV40")]
    assert main([*words, "--json"]) == 130
    found = json.loads(capsys.readouterr().out)["predictions"]
    assert [(one["method"], find_card(one["card"]).chip) for one in found] == computed[:3]


@pytest.mark.parametrize("words, says", [
    (["--predict"], "--predict has no method; give METHOD,METHOD,... or all"),
    (["--predict", "all", "--rays", "eye,shadow"], "this is a list, give one name: eye or shadow"),
    (["--predict", "all", "--card", "nv41"], "no card 'nv41'; give the name or the chip of one"),
    (["--predict", "all", "--card", "nv40,r200"], "give a card of R300, R420, NV40, R580, G80")])
def test_mistakes_of_the_command_get_a_line(capsys, words: list[str], says: str) -> None:
    assert main(["hardware", *words]) == 1
    out, err = capsys.readouterr()
    assert not out and says in err and err.count("\n") == 1


def test_the_page_names_the_rays_that_are_traced(monkeypatch) -> None:
    """docs/hardware.md gives the sizes of the samples. Two cases are exceptions: `kd-packet` on
    NV40 has larger tiles, and all rays of packets on G80 are traced."""
    scene = rt.load_scene("cornell")
    rays = rays_of(scene, RAY_SETS["eye"], 512)
    for method, chip, tile in (("kd-restart", "NV40", 96), ("kd-packet", "NV40", 128),
                               ("kd-packet", "R580", 96), ("bvh-threaded", "G80", 96)):
        samples = image_issues.sampled(rays, method, chip)
        assert samples.tiles.shape == (2 * tile, 2 * tile), (method, chip)
        assert samples.sparse.shape == (128, 128)
    traced: list[int] = []
    trace = Workload.trace
    monkeypatch.setattr(Workload, "trace", lambda self, tracer: (
        traced.append(len(self.origins)), trace(self, tracer))[1])
    for method, most in (("kd-restart", 192 ** 2), ("kd-packet", 256 ** 2)):
        predict(scene, method, "g80", size=256)
        assert max(traced) == most


def test_a_figure_predicts_what_users_predict() -> None:
    """Figure 20 adds the times of eye rays and shadow rays, and divides the sum by the number of
    pixels."""
    figure, scene = fig20.FIGURE, rt.load_scene("cornell")
    panel = next(panel for panel in figure.panels if panel.scene == "cornell")
    for column in figure.columns[1:4]:
        options = dict(column.options)
        kinds = {RAY_SETS[kind]: image_issues.measure(
            scene, workload("cornell", RAY_SETS[kind], 512), column.method, options, "NV40")
            for kind in ("eye", "shadow")}
        row = PredictedRow(figure, panel, column, STEP, 1.0, kinds, False)
        both = [predict(scene, column.method, "nv40", kind, **options)
                for kind in ("eye", "shadow")]
        assert {one.form for one in both} == {STEP} and row.judged
        assert row.nanoseconds() == pytest.approx(
            1e9 * sum(one.seconds for one in both) / 512 ** 2)


@pytest.mark.parametrize("method, chip", [
    ("kd-restart", "nv40"), ("bvh-threaded", "r580"), ("brute-force", "r420"), ("grid", "r300"),
    ("kd-packet", "r580"), ("kd-packet", "nv40")])
def test_a_picture_in_the_era_form_gets_the_same_time(method: str, chip: str) -> None:
    scene = rt.load_scene("cornell")
    with rt.Tracer(scene, method, era=chip) as tracer:
        with era_timed(tracer) as seen:
            tracer.render(size=(64, 64))
        times = {form: seen.on_card(form).seconds for form in seen.forms}
    assert next(iter(times)) == forms_of(method, chip.upper())[0]
    for form, seconds in times.items():
        asked = sum(predict(scene, method, chip, kind, 64, form).seconds
                    for kind in ("eye", "shadow"))
        assert seconds == pytest.approx(asked, rel=0.03)


def test_calls_that_are_not_kept_count_too(monkeypatch) -> None:
    scene = rt.load_scene("cornell")
    monkeypatch.setattr(era_rays, "MOST_CALLS", 1)
    seconds = {}
    with rt.Tracer(scene, "kd-restart", era="nv40") as tracer:
        rays = scene.camera.rays((32, 32))
        for name, calls in (("nearest", [tracer.trace]), ("any", [tracer.occluded]),
                            ("all", [tracer.trace, tracer.occluded, tracer.trace])):
            with era_timed(tracer) as seen:
                for call in calls:
                    call(*rays)
            assert len(seen.kept.calls) == len(seen.kept.pixels)
            seconds[name] = seen.on_card().seconds
    assert seconds["all"] == pytest.approx(2 * seconds["nearest"] + seconds["any"], rel=1e-6)


@pytest.mark.parametrize("method", ["kd-restart", "kd-packet"])
def test_a_picture_is_predicted_from_few_rays(method: str) -> None:
    """`render` traces fewer rays than `predict`, and counts kernels only in the forms that
    `render` prints."""
    with rt.Tracer("cornell", method, era="nv40") as tracer:
        with era_timed(tracer) as seen:
            tracer.render(size=(256, 256), samples=5)
        for any_hit in (False, True):
            calls = [one.samples for one in seen.kept.calls if one.any_hit == any_hit]
            assert len(calls) == era_rays.MOST_CALLS
            assert sum(one.tiles.shape == (128, 128) for one in calls) == len(calls)
            assert sum(one.sparse.shape == (64, 64) for one in calls) == len(calls)
        seen.kept.calls[1:] = []
        assert {form for _, counts in seen._counts for form in counts["issued"]} == set(seen.forms)
        with pytest.raises(OptionError, match="give one of 'step', "):
            seen.on_card("step, 256 pixels")


@pytest.mark.parametrize("method, chip", [("kd-restart", "nv40"), ("kd-packet", "r580")])
def test_rays_start_at_t_min(method: str, chip: str) -> None:
    scene = rt.load_scene("cornell")
    seconds = []
    with rt.Tracer(scene, method, era=chip) as tracer:
        for t_min in (0.0, 1e6):
            with era_timed(tracer) as seen:
                tracer.trace(*scene.camera.rays((64, 64)), t_min=t_min)
            seconds.append(seen.on_card().seconds)
    assert seconds[1] < seconds[0] / 3     # t_min lies behind the scene's box


def test_a_part_of_the_rays_keeps_their_ends() -> None:
    every = rays_of(rt.load_scene("cornell"), RAY_SETS["eye"], 8)
    every = replace(every, t_min=np.arange(64, dtype=np.float32))
    np.testing.assert_array_equal(every.part(np.array([[3, 9]])).t_min, [3, 9])
    np.testing.assert_array_equal(every.compact(2).t_min, [0, 63])


def test_no_rays_have_no_time() -> None:
    with rt.Tracer("cornell", "grid", era="nv40") as tracer:
        with era_timed(tracer) as seen:
            pass
    with pytest.raises(OptionError, match="no rays were traced"):
        seen.on_card()


def test_passes_take_the_time_of_the_whole_trace() -> None:
    scene, method, card = rt.load_scene("cornell"), "kd-restart", find_card("NV40")
    rays = scene.camera.rays((64, 64))
    with rt.Tracer(scene, method, **image_issues.STEPWISE) as tracer:
        issued = issued_in_passes(record_trace(tracer, (64, 64), lambda: tracer.trace(*rays)))
    whole = time_of_passes(
        card, issued, {name: static_cost("nv40", method, name) for name in issued.kernels},
        {name: stream_fetches(method, name, in_loop=False) for name in issued.kernels}, 64 * 64)
    found = predict(scene, method, "nv40", size=64, form=PASSES)
    assert found.parts["waiting lanes"] > 0
    assert found.time.parts == pytest.approx(whole.parts)


@pytest.mark.parametrize("kind", ["eye", "shadow"])
def test_packets_take_the_time_of_their_kernels(kind: str) -> None:
    scene, card, any_hit = rt.load_scene("shirley6"), find_card("R580"), kind == "shadow"
    rays = rays_of(scene, RAY_SETS[kind], 56)
    with rt.Tracer(scene, "kd-packet", **image_issues.STEPWISE, **HORN) as tracer:
        trace = packet_trace.in_loop(record_trace(
            tracer, (56, 56), lambda: rays.trace(tracer), packet_trace.fields_of(True)), True)
    issued = issued_in_loop(trace, GROUPS["R580"], WHILE_WHILE, WITHIN)
    costs = {name: static_cost("r580", "kd-packet", name, any_hit, True, **HORN)
             for name in trace.kernels}
    streams = {name: stream_fetches("kd-packet", name, any_hit, **HORN) for name in trace.kernels}
    # The instructions outside the kernels run once for the four rays of a packet.
    whole = static_cost("r580", "kd-packet", "loop", any_hit, True, **HORN).arithmetic
    setup = (whole - sum(cost.arithmetic for cost in costs.values())) / 4
    assert setup_slots("r580", "kd-packet", any_hit, **HORN) == setup > 20
    time = time_of_loop(card, issued, costs, streams, 56 * 56, setup=setup)
    assert predict(scene, "kd-packet", "r580", rays).seconds == pytest.approx(time.seconds)


@pytest.mark.parametrize("method, chip", [("kd-restart", "nv40"), ("kd-packet", "r580")])
def test_samples_of_an_image_represent_all_its_rays(monkeypatch, method: str, chip: str) -> None:
    scene = rt.load_scene("cornell")
    whole = predict(scene, method, chip, size=128)
    monkeypatch.setattr(image_issues, "TILE", 16)
    monkeypatch.setattr(image_issues, "SPARSE", 64)
    samples = image_issues.sampled(rays_of(scene, RAY_SETS["eye"], 256), method, chip.upper())
    assert len(samples.sparse.origins) == 64 ** 2
    # The sample has two tiles along each axis. A tile consists of whole groups. A group has 32x32
    # rays, or 6x8 packets of 2x2 rays.
    assert samples.tiles.shape == ((64, 64) if method == "kd-restart" else (48, 32))
    assert predict(scene, method, chip, size=128).seconds == pytest.approx(whole.seconds, rel=0.3)


def test_samples_of_an_image_that_is_not_square() -> None:
    rays = rt.load_scene("cornell").camera.rays((300, 50))
    every = replace(workload("cornell", RAY_SETS["eye"], 8), size=300, shape=(50, 300),
                    origins=rays[0].reshape(-1, 3), directions=rays[1].reshape(-1, 3))
    samples = image_issues.sampled(every, "kd-restart", "NV40")
    assert samples.pixels == 300 * 50 and samples.sparse.shape == (50, 128)
    assert samples.tiles.shape == (50, 192)
    # Neighbours in a tile are neighbours in the image.
    np.testing.assert_array_equal(
        samples.tiles.directions.reshape(50, 192, 3)[:, :96], rays[1][:, 26:122])


def test_an_option_that_changes_the_kernels_changes_their_cost() -> None:
    scene = rt.load_scene("cornell")
    program, plain = ({one.kernel: one.digest for one in era_programs(
        "bvh-threaded", in_loop=True, octants=octants)} for octants in (True, False))
    assert program != plain
    found, usual = (predict(scene, "bvh-threaded", "nv40", size=16, octants=octants).seconds
                    for octants in (True, False))
    assert math.isfinite(found) and found != usual
    with pytest.raises(OptionError, match="was not compiled for r580"):
        predict(scene, "kd-packet", "r580", size=16, push_down=False, stack_size=3)


@pytest.mark.parametrize("kind", RAY_SETS)
def test_rays_of_a_scene_object_are_those_of_its_name(kind: str) -> None:
    named, of_object = (workload("cornell", RAY_SETS[kind], 24),
                        rays_of(rt.load_scene("cornell"), RAY_SETS[kind], 24))
    for name in ("origins", "directions", "ends"):
        np.testing.assert_array_equal(getattr(named, name), getattr(of_object, name))


def test_a_moved_camera_changes_the_time() -> None:
    """Rays of a scene object are not cached."""
    scene = rt.load_scene("cornell")
    before = predict(scene, "grid", "nv40", size=32).seconds
    scene.camera = replace(scene.camera, eye=tuple(np.add(scene.camera.eye, (0, 0, -300))))
    assert predict(scene, "grid", "nv40", size=32).seconds != before


@pytest.mark.parametrize("words, more, says", [
    (("kd-restart", "nv41"), {}, r"no card 'nv41'; give .*NVIDIA GeForce 6800 Ultra \(NV40\)"),
    (("kd-restart", "r200"), {}, "give a card of R300, R420, NV40, R580, G80"),
    (("kd-packet", "r420"), {}, "could not have run method kd-packet, which needs loops"),
    (("kd-stack", "r420"), {}, "could not have run method kd-stack, which needs loops"),
    (("kd-stack", "nv40"), {}, "kd-stack, which needs a local array"),
    (("kd-texture-stack", "g80"), {}, "with passes on the G80; give another card"),
    (("kd-restart", "nv40", "eyes"), {}, "did you mean eye?"),
    (("kd-restart", "nv40", ["eye"]), {}, "give a Workload or one of eye, shadow"),
    (("kd-restart", None), {}, "card is None; give a card's name"),
    (("kd-restart", "nv40"), {"form": "stp"}, "did you mean 'step'?"),
    (("kd-restart", "nv40"), {"form": "passes, block"}, "did you mean 'passes'"),
    (("kd-restart", "nv40"), {"form": "x"}, "known: 'passes', 'step', 'step, 256 pixels', 'wh"),
    (("brute-force", "nv40"), {"nodes": 3}, "has no option 'nodes'; leave it out"),
    *((("kd-restart", "nv40"), {name: value}, f"has no option '{name}'") for name, value in (
        ("nodes", 3), ("schedule", "loop"), ("statistics", True), ("era", "r300"),
        ("precision", "fp16")))])
def test_mistakes_get_a_line(words, more, says: str) -> None:
    with pytest.raises(OptionError, match="(?i)" + says.replace("?", r"\?")) as failure:
        predict(rt.load_scene("cornell"), *words, size=8, **more)
    assert "\n" not in str(failure.value)
    with pytest.raises(OptionError, match="scene is a str; give a Scene"):
        predict("cornell", "kd-restart", "nv40")
