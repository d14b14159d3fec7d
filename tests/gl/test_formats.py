"""Number formats of the cards of 2002-2007: GLSL and numpy round alike, rounding keeps the order
of values, quantised boxes contain the exact boxes, and schedules agree on hits."""
from __future__ import annotations

import numpy as np
import pytest
from conftest import RAY_SETS, SCHEDULES, assert_same_bits, schedules_of, soup_scene
from hypothesis import given
from hypothesis import strategies as st

import gpgpu_rt as rt
from gpgpu_rt.accel.quantise import decode, quantise
from gpgpu_rt.gl.context import open_gpu
from gpgpu_rt.gl.full_screen import FullScreenPass
from gpgpu_rt.gl.packed_record import PackedRecord
from gpgpu_rt.gl.precision import FORMATS, ROUNDINGS, Precision
from gpgpu_rt.gl.textures import make_texture, read_texture, table_textures

METHODS = [row.name for row in rt.methods()]
LOW = ("fp24", "fp16")


def awkward_values(seed: int) -> np.ndarray:
    """Return values at and between the limits of every format, infinity, and all their
    negatives."""
    rng = np.random.default_rng(seed)
    edges = [v for f in FORMATS.values() for v in (f.smallest, f.quantum, f.quantum / 2, f.largest,
                                                   1 + f.unit, 1 + 3 * f.unit)]
    with np.errstate(over="ignore"):
        values = np.float32([0, 1, 1 / 3, 65519, 65520, 7e4, 1e30, np.inf, *edges])
        values = np.concatenate([values, np.nextafter(values, np.float32(9)),
                                 np.float32(2.0) ** rng.uniform(-60, 60, 2000)
                                 * rng.choice([1, -1], 2000)])
    values = values[(np.abs(values) >= 2.0 ** -125) | (values == 0)]   # llvmpipe flushes denormals
    return np.concatenate([values, -values]).astype(np.float32)


@pytest.mark.small
@pytest.mark.parametrize("rounding", ROUNDINGS)
@pytest.mark.parametrize("name", LOW)
def test_glsl_rounds_as_python_does(name: str, rounding: str, tmp_path) -> None:
    gpu = open_gpu()
    values = awkward_values(3)
    probe = tmp_path / "probe.frag"
    probe.write_text('#version 330 core\n#include "core/precision.glsl"\n'
                     "uniform sampler2D values;\nout vec4 result;\nvoid main() {\n"
                     "    float x = texelFetch(values, ivec2(gl_FragCoord.xy), 0).x;\n"
                     "    result = vec4(stored(x), R(x), stored(vec2(x)).y, R(vec3(x)).z);\n}\n")
    shader = FullScreenPass(gpu, str(probe), Precision(name, name, rounding).defines())
    texture = make_texture(gpu, (len(values), 1), 1, "values", values[None, :, None])
    target = gpu.context.framebuffer([make_texture(gpu, (len(values), 1), 4, "probe")])
    shader.draw(target, {"values": texture})
    result = read_texture(target.color_attachments[0])[0]
    expected = FORMATS[name].round(values, rounding)
    for channel in range(4):
        differ = np.flatnonzero(result[:, channel].view(np.uint32) != expected.view(np.uint32))
        assert not len(differ), (values[differ][:5], result[differ, channel][:5],
                                 expected[differ][:5])


@given(st.floats(width=32, allow_nan=False, min_value=-65504, max_value=65504))
def test_fp16_to_nearest_is_ieee_half(value: float) -> None:
    assert FORMATS["fp16"].round(np.float32([value]))[0] == np.float32(np.float16(value))


@pytest.mark.parametrize("name", LOW)
def test_rounding_keeps_order_and_direction(name: str) -> None:
    values = np.sort(awkward_values(7))
    rounded = {rounding: FORMATS[name].round(values, rounding) for rounding in ROUNDINGS}
    for rounding, result in rounded.items():
        assert (np.diff(result[np.isfinite(result)]) >= 0).all(), rounding
        assert (FORMATS[name].round(result, rounding) == result).all(), rounding
        assert (np.isinf(result) == np.isinf(values)).all()   # no finite value overflows
    inside = np.abs(values) <= FORMATS[name].largest
    assert (rounded["up"] >= values)[inside].all()
    assert (np.abs(rounded["chop"]) <= np.abs(values)).all()


def test_fp32_programs_do_not_round() -> None:
    assert set(Precision().defines()) == {"ROUNDING_NEAREST"}
    with rt.Tracer(soup_scene(20, 1), "grid", precision="fp16", storage="fp32") as tracer:
        assert tracer.precision == Precision("fp32", "fp16")


LOWER = {"fp16-stored": {"storage": "fp16"}, "fp24-computed": {"arithmetic": "fp24"},
         "fp16-up": {"precision": "fp16", "rounding": "up"}}
# Each case compiles its own programs, so the quick suite runs `step1` and `step16` with one format
# each. The schedule `kernels` has the most programs, so the quick suite runs `kernels` with one
# format and three methods (FAMILIES).
QUICK = {("fp16-stored", "step1"), ("fp24-computed", "step16")}
FAMILIES = ("grid", "kd-backtrack", "bvh-threaded")
IN_PASSES = [pytest.param(row.name, lower, name, id=f"{lower}-{name}-{row.name}",
                          marks=() if (lower, name) in QUICK or (lower, name) == (
                              "fp16-stored", "kernels") and row.name in FAMILIES
                          else pytest.mark.full)
             for row in rt.methods() for lower in LOWER
             for name in schedules_of(row, ("step1", "kernels", "step16"))]


@pytest.mark.parametrize("method, lower, schedule", IN_PASSES)
def test_schedules_agree_in_low_precision(precise_renderer, method: str, lower: str,
                                          schedule: str) -> None:
    """Under `loop`, each step rounds its state as the textures of the other schedules do."""
    scene = soup_scene(60, seed=12)
    rays = RAY_SETS["random"](scene, 400, 3)
    options = {**LOWER[lower], "step_cap": 500}
    answers = []
    for more in ({}, SCHEDULES[schedule]):
        with rt.Tracer(scene, method, **options, **more) as tracer:
            answers.append(tracer.trace(*rays))
    assert_same_bits(*answers)
    assert (answers[0].status == answers[1].status).all()


@pytest.mark.parametrize("lower", [
    lower if lower == "fp16-stored" else pytest.param(lower, marks=pytest.mark.full)
    for lower in LOWER])
@pytest.mark.parametrize("method", METHODS)
def test_low_precision_changes_hits(method: str, lower: str) -> None:
    scene = soup_scene(60, seed=12)
    rays = RAY_SETS["random"](scene, 400, 3)
    answers = []
    for options in ({}, {**LOWER[lower], "step_cap": 500}):
        with rt.Tracer(scene, method, **options) as tracer:
            answers.append(tracer.trace(*rays))
    full, low = answers
    assert (low.t != full.t).mean() > 0.1 * full.hit.mean(), "the option changed nothing"


@pytest.mark.parametrize("method", METHODS)
def test_half_textures_are_half(method: str) -> None:
    scene = soup_scene(30, 2)
    with rt.Tracer(scene, method, storage="fp16") as tracer:
        image = tracer.render(size=(16, 16))
        dtypes = {texture.dtype for texture in tracer.session.buffers.states.side(0).textures}
        assert dtypes == {"f2", "f4"} and image.size == (16, 16)
        assert {texture.dtype for texture in tracer.session.buffers.rays.textures} == {"f2"}


@given(seed=st.integers(0, 999), bits=st.sampled_from([8, 16]), scale=st.integers(-20, 20))
def test_quantised_boxes_contain_the_exact_boxes(seed: int, bits: int, scale: int) -> None:
    rng = np.random.default_rng(seed)
    corners = (rng.normal(size=(2, 50, 3)) * 2.0 ** scale + rng.normal(size=3) * 2.0 ** (
        scale + 8 * (seed % 2))).astype(np.float32)
    corners[:, :, seed % 3] = corners[0, 0, seed % 3] if seed % 5 == 0 else corners[:, :, seed % 3]
    lo, hi = corners.min(0), corners.max(0)
    base, top = lo.min(0), hi.max(0)
    quantum, (q_lo, q_hi) = quantise(lo, hi, base, top, bits)
    assert (decode(q_lo, base, quantum) <= lo).all() and (decode(q_hi, base, quantum) >= hi).all()
    assert min(q_lo.min(), q_hi.min()) >= 0 and max(q_lo.max(), q_hi.max()) < 1 << bits
    assert (decode(q_lo + 2, base, quantum) >= lo).all()   # at most 2 quanta too low


@pytest.mark.parametrize("octants", [False, True])
@pytest.mark.parametrize("bits, least", [(16, 1.9), (8, 2.4)])
def test_quantised_nodes_are_smaller(bits: int, least: float, octants: bool) -> None:
    scene = soup_scene(20_000, seed=4, size=0.01)
    sizes = []
    for quantise_nodes in (None, bits):
        with rt.Tracer(scene, "bvh-threaded", quantise_nodes=quantise_nodes,
                       octants=octants) as tracer:
            sizes.append(tracer.statistics.table_bytes)
    assert sizes[0]["bvh_node"] >= least * sizes[1]["quantised_node"]


@pytest.mark.parametrize("bits", [16, 8])
def test_quantised_octants_hit_the_same(bits: int) -> None:
    """A tree has a copy for each octant of directions. Along an axis, the copy swaps the two
    bounds of a box if the octant's rays meet the upper bound first. The bounds of a flat box are
    equal, but quantising rounds the lower bound down and the upper bound up. If the
    copy swapped the bounds before quantising, rays would miss the box."""
    scene = rt.load_scene("cornell")
    rays = RAY_SETS["random"](scene, 400, 3)
    answers = []
    for options in ({}, {"octants": True, "quantise_nodes": bits}):
        with rt.Tracer(scene, "bvh-threaded", **options) as tracer:
            answers.append(tracer.trace(*rays))
    assert answers[0].hit.any()
    assert_same_bits(*answers)


def test_packed_records_round_trip(tmp_path) -> None:
    gpu = open_gpu()
    record = PackedRecord("mixed", "a:8 b:24 | c:32 | d:30 e:1 f:1")
    rng = np.random.default_rng(8)
    count = 4096 + 40
    fields = {name: rng.integers(0, 1 << bits, count) for name, _, _, bits in record.fields}
    tables = table_textures(gpu, record, fields)
    for name, *_ in record.fields:
        probe = tmp_path / "probe.frag"
        probe.write_text('#version 330 core\n#include "core/fetch.glsl"\n#include <tables>\n'
                         "out vec4 value;\nvoid main() {\n"
                         f"    uint read = mixed_{name}(int(gl_FragCoord.x));\n"
                         "    value = vec4(read & 0xffffu, read >> 16, 0.0, 0.0);\n}\n")
        reader = FullScreenPass(gpu, str(probe), {"TABLE_WIDTH_LOG2": 12},
                                {"tables": record.table_glsl()})
        target = gpu.context.framebuffer([make_texture(gpu, (count, 1), 4, "probe")])
        reader.draw(target, tables)
        halves = read_texture(target.color_attachments[0])[0].astype(np.int64)
        assert (halves[:, 0] + (halves[:, 1] << 16) == fields[name]).all(), name
    with pytest.raises(rt.LimitError, match="mixed.b does not fit"):
        record.pack(a=[0], b=[1 << 24], c=[0], d=[0], e=[0], f=[0])
