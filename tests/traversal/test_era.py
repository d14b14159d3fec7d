"""The era form of a method consists of kernels that a card of 2002-2006 could run (docs/era.md).
The era form finds the same triangles as today's form. The kernels are in the cards' dialect of
GLSL."""
from __future__ import annotations

import re

import numpy as np
import pytest

import gpgpu_rt as rt
from gpgpu_rt.errors import LimitError, OptionError
from gpgpu_rt.gl.precision import PRECISIONS
from gpgpu_rt.inspect.program_text import program_text
from gpgpu_rt.inspect.time_travel import travel
from gpgpu_rt.methods import methods
from gpgpu_rt.options import ERA_TARGETS, ERAS
from gpgpu_rt.scene.loading import load_scene
from gpgpu_rt.traversal.era import INIT, TESTS_TRIANGLES, era_kernels

SIDE = 64
NAMES = [row.name for row in methods() if not row.why_no_era_form() and not row.era_packets]
_NOT_IN_1_20 = re.compile(
    r"\b(int|uint|ivec\d|uvec\d|texelFetch|textureSize|layout)\b|<<|>>|[^&]&[^&]")


def _kernels(name):
    row = next(row for row in methods() if row.name == name)
    options = row.resolved({"era": "nv40"})
    return era_kernels(row.formed(options), options, defines={"STACK_SIZE": 8})


@pytest.fixture(scope="module")
def scenes():
    return {name: load_scene(name) for name in ("cornell", "shirley6")}


@pytest.mark.parametrize("name, era", [(row.name, era) for row in methods() for era in ERAS
                                       if row.name in NAMES and not row.why_no_era_form(era)])
@pytest.mark.parametrize("scene", ["cornell", "shirley6"])
def test_finds_the_same_triangles(scenes, name, scene, era):
    rays = scenes[scene].camera.rays((SIDE, SIDE))
    with rt.Tracer(scenes[scene], name, intersection="moller-trumbore",
                   precision=ERAS[era]["precision"]) as tracer:
        today = tracer.trace(*rays)
    with rt.Tracer(scenes[scene], name, era=era) as tracer:
        era_hits = tracer.trace(*rays)
    assert (today.triangle >= 0).sum() > SIDE * SIDE / 10
    assert (era_hits.triangle != today.triangle).sum() <= SIDE * SIDE / 1e4
    same = (era_hits.triangle == today.triangle) & (today.triangle >= 0)
    np.testing.assert_array_equal(era_hits.t[same], today.t[same])


@pytest.mark.parametrize("name", NAMES)
def test_shadow_rays_stop_at_a_hit(scenes, name):
    rays = scenes["cornell"].camera.rays((SIDE, SIDE))
    with rt.Tracer(scenes["cornell"], name, intersection="moller-trumbore") as tracer:
        today = tracer.occluded(*rays)
    with rt.Tracer(scenes["cornell"], name, era="nv40") as tracer:
        assert (tracer.occluded(*rays) == today).all()


@pytest.mark.parametrize("more", [
    {"stack_size": 1}, {"stack_size": 2}, {"push_down": False},
    {"stack_size": 1, "push_down": False}], ids=str)
def test_a_short_stack_may_be_shorter(scenes, more):
    """With any stack, a ray visits the same nodes and tests the same triangles in the era form as
    in today's form. So the numbers of passes agree."""
    rays = scenes["shirley6"].camera.rays((SIDE, SIDE))
    with rt.Tracer(scenes["shirley6"], "kd-short-stack", intersection="moller-trumbore",
                   schedule="kernels", **more) as tracer:
        today, passes = tracer.trace(*rays), tracer.statistics.kernel_passes
    with rt.Tracer(scenes["shirley6"], "kd-short-stack", era="nv40", **more) as tracer:
        found = tracer.trace(*rays)
        assert tracer.statistics.kernel_passes == passes
    np.testing.assert_array_equal(found.t, today.t)


@pytest.mark.parametrize("name", NAMES)
def test_passes_can_be_watched(scenes, name):
    """`travel` shows all rays after each pass. After the last pass, no ray is live, and the hits
    equal the hits of `trace`."""
    rays = scenes["cornell"].camera.rays((16, 16))
    seen = []
    with rt.Tracer(scenes["cornell"], name, era="nv40") as tracer:
        found = travel(tracer, *rays, seen.append)
        hits = tracer.trace(*rays)
    assert not seen[-1].live and len(seen) > 2
    np.testing.assert_array_equal(found.triangle, hits.triangle)
    served = [sum(one.served.values()) for one in seen[1:]]
    assert max(served) > 16 and sum(served) >= 16 * 16


@pytest.mark.parametrize("name", NAMES)
def test_rays_along_an_axis_end(scenes, name):
    """The search of a ray with zero components ends: a tiny number replaces each zero, because the
    inverse of zero is infinite, and zero times infinity is NaN."""
    scene = scenes["cornell"]
    lo, hi = scene.bounds
    at = np.linspace(lo, hi, 9)[:, None] * [1.0, 1.0, 0.0] + [0, 0, lo[2] - 1]
    direction = np.broadcast_to([0.0, 0.0, 1.0], at.shape)
    with rt.Tracer(scene, name, intersection="moller-trumbore") as tracer:
        today = tracer.trace(at, direction)
    with rt.Tracer(scene, name, era="nv40") as tracer:
        found = tracer.trace(at, direction)
    # The first and the last ray lie in sides of the scene's box. Their hits may differ, because
    # the box test of the era form has no margin for rounding.
    inside = slice(1, -1)
    assert (found.hit[inside] == today.hit[inside]).all()


@pytest.mark.parametrize("name", NAMES)
def test_text_is_in_the_dialect_of_the_cards(name):
    for kernel in _kernels(name):
        text = program_text(kernel.source("card"))
        code = "\n".join(line.partition("//")[0] for line in text.splitlines())
        assert not _NOT_IN_1_20.search(code), (kernel.name, _NOT_IN_1_20.search(code))
        assert text.startswith("#version 120\n")


@pytest.mark.parametrize("name", NAMES)
def test_only_the_triangle_test_and_the_start_write_hits(name):
    for kernel in _kernels(name):
        text = program_text(kernel.source("card"))
        assert ("accept(" in text) == (kernel.name == TESTS_TRIANGLES), kernel.name
        assert ("hit_store(" in text) == (kernel.name in (INIT, TESTS_TRIANGLES)), kernel.name
        assert text.count("TARGET(") - 1 <= ERA_TARGETS


@pytest.mark.parametrize("name", [row.name for row in methods() if row.why_no_era_form()])
def test_other_methods_say_that_they_have_no_era_form(scenes, name):
    with pytest.raises(OptionError, match="has no era form: "):
        rt.Tracer(scenes["cornell"], name, era="r420")


@pytest.mark.parametrize("more", [
    {"statistics": True}, {"sort_rays": True}, {"step_cap": 9}, {"steps_per_pass": 4},
    {"schedule": "loop"}, {"intersection": "woop-watertight"}, {"precision": "fp32"},
    {"storage": "fp16"}, {"arithmetic": "fp16"}, {"interval": "strict"}], ids=str)
def test_options_that_the_era_form_does_not_have_are_refused(scenes, more):
    with pytest.raises(OptionError, match=f"era.*{next(iter(more))}|{next(iter(more))}.*era"):
        rt.Tracer(scenes["cornell"], "kd-restart", era="r420", **more)


def test_statistics_in_the_era_form_are_refused_with_the_reason(scenes):
    with pytest.raises(OptionError, match="because kernels in the era form count nothing; leave "
                       "era out to count"):
        rt.Tracer(scenes["cornell"], "kd-restart", era="nv40", statistics=True)


@pytest.mark.parametrize("era", ERAS)
def test_only_the_numbers_of_a_chip_may_be_given(scenes, era):
    for name in ("precision", "storage", "arithmetic"):
        for value in PRECISIONS:
            if value == ERAS[era]["precision"]:
                rt.Tracer(scenes["cornell"], "kd-restart", era=era, **{name: value}).release()
                continue
            with pytest.raises(OptionError, match=f"era={era} implies.*; leave {name} out"):
                rt.Tracer(scenes["cornell"], "kd-restart", era=era, **{name: value})


def test_the_reason_names_the_option_that_has_no_era_form(scenes):
    with pytest.raises(OptionError, match="grid with packet=2x2 has no era form"):
        rt.Tracer(scenes["cornell"], "grid", packet=(2, 2), era="nv40")


def test_a_state_of_too_many_targets_is_refused(scenes):
    with pytest.raises(OptionError, match="stack_size=4 has no era form: .* 6 render targets"):
        rt.Tracer(scenes["cornell"], "kd-short-stack", stack_size=4, era="nv40")


@pytest.mark.parametrize("name, options, reason", [
    ("kd-short-stack", {}, "6 render targets"),
    ("bvh-threaded", {"octants": True, "shared_subtrees": 8}, "fp24 cannot hold")], ids=str)
def test_a_form_that_fp24_does_not_hold_is_refused(scenes, name, options, reason):
    rt.Tracer(scenes["cornell"], name, era="nv40", **options).release()
    with pytest.raises(OptionError, match=f"has no era form for r420: .*{reason}"):
        rt.Tracer(scenes["cornell"], name, era="r420", **options)


def test_a_search_that_does_not_end_is_an_error(scenes):
    """No setting with an endless search is known, so the test lowers the cap instead."""
    rays = scenes["cornell"].camera.rays((16, 16))
    with rt.Tracer(scenes["cornell"], "kd-restart", era="nv40") as tracer:
        tracer.session.driver.step_cap = 3
        with pytest.raises(LimitError, match="does not end"):
            tracer.trace(*rays)
