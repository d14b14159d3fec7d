"""Labels of options are plain words, and the viewer knows the options' automatic values."""
from __future__ import annotations

import numpy as np
import pytest
from windowless import METHODS, full

import gpgpu_rt as rt
from gpgpu_rt.methods import find_method
from gpgpu_rt.options import AUTOMATIC, OFF, TRACER_OPTIONS, Option
from gpgpu_rt.render.integrators import INTEGRATORS
from gpgpu_rt.viewer.automatic import shown

LONGEST = 24        # limit on a label's characters, so that it fits its column in the panel


@pytest.mark.parametrize("options", [
    *(TRACER_OPTIONS + find_method(name).options for name in METHODS),
    *(kind.options for kind in INTEGRATORS.values())])
def test_labels_are_short_plain_and_different(options: tuple[Option, ...]) -> None:
    titles = [option.title for option in options]
    assert len(set(titles)) == len(titles)
    for option in options:
        assert len(option.title) <= LONGEST and "_" not in option.title, option.name
        assert option.unset in (AUTOMATIC, OFF)
        assert {choice for choice, _ in option.meanings} <= set(option.choices or ())
        if option.unset == OFF:      # an option that is off when unset has no default value
            assert option.default is None


def test_a_choice_has_its_meaning() -> None:
    schedule = next(option for option in TRACER_OPTIONS if option.name == "schedule")
    assert schedule.choice_words("loop") == "loop: all steps in one pass"
    assert find_method("kd-packet").options[-1].choice_words(None)
    packet = next(o for o in find_method("bvh-packet").options if o.name == "packet")
    assert packet.choice_words((4, 2)) == "4x2"


# (method, names of the options whose automatic values are tested, other options)
AUTOMATICS = [("kd-restart", "max_depth", {}), ("kd-stack", "stack_size", {}),
              ("kd-restart", "morton_bits", {"build": "hybrid"}),
              ("bvh-threaded", "morton_bits", {"build": "lbvh"}),
              ("bvh-threaded", "morton_bits", {"build": "hybrid"}),
              ("grid", "resolution", {}), ("ray-engine", "resolution", {}),
              ("visibility-field", "directions tiles", {}),
              ("kd-restart", "mask_interval", {"schedule": "step"}),
              ("kd-restart", "mask_interval", {"schedule": "step", "steps_per_pass": 3}),
              ("kd-restart", "mask_interval", {"schedule": "kernels"}),
              full("bvh-packet", "mask_interval", {"schedule": "step"}),
              ("grid", "storage", {}), ("grid", "precision", {})]


@pytest.mark.parametrize("method, names, options", AUTOMATICS)
def test_an_automatic_value_given_as_a_value_changes_nothing(soup: str, method: str, names: str,
                                                             options: dict) -> None:
    """The shown automatic value is right: if the user gives this value instead, tables, passes and
    memory are the same."""
    scene = rt.load_scene(soup)
    rays = scene.camera.rays((24, 18))
    table = {o.name: o for o in TRACER_OPTIONS + find_method(method).options}
    with rt.Tracer(scene, method, **options) as tracer:
        now = {name: shown(table[name], options, tracer) for name in names.split()}
        tracer.trace(*rays)
        cost, tables = tracer.statistics.passes, tracer.accelerator.tables
        bytes_used, live = tracer.statistics.texture_bytes, list(tracer.statistics.live)
    assert all(one.value is None and one.none.startswith("automatic (") for one in now.values())
    given = {name: table[name].parse(one.none[len("automatic ("):-1])
             for name, one in now.items()}
    with rt.Tracer(scene, method, **{**options, **given}) as tracer:
        tracer.trace(*rays)
        assert tracer.statistics.passes == cost and list(tracer.statistics.live) == live
        assert tracer.statistics.texture_bytes == bytes_used
        for record, fields in tracer.accelerator.tables.items():
            for field, values in fields.items():
                assert np.array_equal(values[:], tables[record][field][:])
        assert all(shown(table[name], given, tracer).value == given[name] for name in given)


def test_values_that_other_options_imply_are_shown(soup: str) -> None:
    scene, table = rt.load_scene(soup), {option.name: option for option in TRACER_OPTIONS}
    with rt.Tracer(scene, "grid", precision="fp16") as tracer:
        given = {"precision": "fp16"}
        assert shown(table["storage"], given, tracer).none == "automatic (fp16)"
        assert shown(table["precision"], given, tracer).value == "fp16"
        assert shown(table["era"], given, tracer).none == OFF
    with rt.Tracer(scene, "kd-restart", era="r300") as tracer:
        assert shown(table["intersection"], {"era": "r300"}, tracer).value == "moller-trumbore"
        assert shown(table["schedule"], {"era": "r300"}, tracer).value == "kernels"


@pytest.mark.parametrize("options, passes", [
    ({"schedule": "step"}, 16), ({"schedule": "step", "steps_per_pass": 3}, 5),
    ({"schedule": "step", "steps_per_pass": 100}, 2), ({"schedule": "kernels"}, 16),
    ({"schedule": "kernels", "mask_interval": 4}, 4)])
def test_live_rays_are_counted_after_about_sixteen_steps(soup: str, options: dict,
                                                         passes: int) -> None:
    with rt.Tracer(rt.load_scene(soup), "kd-restart", **options) as tracer:
        assert tracer.session.driver.mask_interval == passes
