"""Row 35 of the catalogue of extreme cases (docs/extremes.md): indices around 2^11, 2^17 and 2^24
survive a round trip through a texture. Rays in images of odd widths give the same hits as rays in
a list."""
from __future__ import annotations

import numpy as np
import pytest
from conftest import assert_same_bits, soup_scene

import gpgpu_rt as rt
from gpgpu_rt.gl.context import Gpu
from gpgpu_rt.gl.full_screen import FullScreenPass
from gpgpu_rt.gl.record import EXACT_INTEGER, SMALL_INTEGER, TABLE_WIDTH_LOG2, Record
from gpgpu_rt.gl.textures import largest_integer, read_texture, stream_textures, table_textures
from gpgpu_rt.session import scene_tables

NUMBER = Record("number", "own:int twice:int")
PROBE, ANSWER = Record("probe", "index:int"), Record("answer", "index:int own:int twice:int")
FETCH = """#version 330 core
#include "core/fetch.glsl"
#include <streams>
#include <tables>
void main() {
    int i = probe_load(ivec2(gl_FragCoord.xy)).index;
    answer_store(Answer(i, number_own(i), number_twice(i)));
}
"""


def indices(exponent: int) -> list[int]:
    return [2**exponent + offset for offset in (-1, 0, 1)]


@pytest.mark.parametrize("exponent, small", [
    (11, False), (11, True), (17, False), (17, True),
    pytest.param(21, True, marks=pytest.mark.full),
    pytest.param(23, False, marks=pytest.mark.full)])
def test_row_35_indices_round_trip(gpu: Gpu, exponent: int, small: bool, tmp_path) -> None:
    """A shader fetches the right entry for every index. A shader that computed the texture row by
    a rounded reciprocal would fail at row ends. An entry has its index and twice its index, so
    the numbers reach 2^24 with exponent 23. With ``small``, the program reads an integer from the
    bits of a float (core/fetch.glsl). The table then also has negative numbers, down to -2^22."""
    count = indices(exponent)[-1] + 1
    size = (1024, -(-count // 1024))
    asked = np.minimum(np.arange(size[0] * size[1]), count - 1)
    numbers = np.arange(count)
    twice = np.minimum(2 * numbers, SMALL_INTEGER if small else EXACT_INTEGER)
    if small:
        twice[::2] *= -1
        twice[-2:] = -SMALL_INTEGER, SMALL_INTEGER
    (tmp_path / "fetch.frag").write_text(FETCH)
    arrays = {"own": numbers, "twice": twice}
    assert largest_integer(NUMBER, arrays) == np.abs(twice).max()
    tables = table_textures(gpu, NUMBER, arrays)
    streams = [stream_textures(gpu, record, size) for record in (PROBE, ANSWER)]
    streams[0][0].write(PROBE.pack(index=asked))
    target = gpu.context.framebuffer(streams[1])
    program = FullScreenPass(
        gpu, str(tmp_path / "fetch.frag"),
        {"TABLE_WIDTH_LOG2": TABLE_WIDTH_LOG2, "SMALL_INTEGERS": small},
        {"tables": NUMBER.table_glsl(),
         "streams": PROBE.stream_glsl(False) + "\n" + ANSWER.stream_glsl(True)})
    program.draw(target, {**tables, "probe_texel_0": streams[0][0]})
    answer = ANSWER.unpack(read_texture(streams[1][0]).reshape(-1, 1, 4))
    program.release()
    gpu.release(target)
    for texture in (*tables.values(), *streams[0], *streams[1]):
        texture.release()
    assert np.array_equal(answer["index"], asked) and np.array_equal(answer["own"], asked)
    assert np.array_equal(answer["twice"], twice[asked])


@pytest.mark.parametrize("method", ["kd-restart", "bvh-threaded", "grid", "bih"])
def test_row_35_larger_integers_are_converted_exactly(monkeypatch: pytest.MonkeyPatch,
                                                      method: str) -> None:
    """If an integer of a table exceeds SMALL_INTEGER, no program reads integers from the bits of
    floats."""
    scene = soup_scene(60, 2)
    rays = np.random.default_rng(3).random((2, 300, 3)).astype(np.float32)
    with rt.Tracer(scene, method) as tracer:
        expected = tracer.trace(*rays)
        assert tracer.accelerator.small_integers
        monkeypatch.setattr(scene_tables, "SMALL_INTEGER", 10)
        tracer.update(scene.triangles)      # the programs are made again
        assert_same_bits(tracer.trace(*rays), expected)
        assert not tracer.accelerator.small_integers
    with rt.Tracer(scene, method) as tracer:
        assert_same_bits(tracer.trace(*rays), expected)
        assert not tracer.accelerator.small_integers


def test_row_35_two_to_the_24() -> None:
    """A float texel stores integers up to 2^24; packing refuses the next integer."""
    for value in indices(24)[:2]:
        packed = NUMBER.pack(own=np.array([value, -value]))
        assert NUMBER.unpack(packed)["own"].tolist() == [value, -value]
    with pytest.raises(rt.LimitError, match="2.24"):
        NUMBER.pack(own=np.array([indices(24)[2]]))


def test_row_35_tables_that_grow_use_no_bits(gpu: Gpu, monkeypatch: pytest.MonkeyPatch) -> None:
    """The lists of ray classification grow while rays are traced, and their integers may pass
    SMALL_INTEGER. Therefore the programs do not read integers from the bits of floats."""
    monkeypatch.setattr(gpu, "programs", {})    # other tests may have compiled the same texts
    with rt.Tracer(soup_scene(60, 2), "ray-classification", context=gpu) as tracer:
        rays = np.random.default_rng(3).random((2, 300, 3)).astype(np.float32)
        hits = tracer.trace(*rays)
        texts = [key[1] for key in gpu.programs if "ray_box_table" in key[1]]
    assert hits.hit.any() and texts
    assert not any("#define SMALL_INTEGERS" in text for text in texts)


@pytest.mark.small
@pytest.mark.parametrize("method", [row.name for row in rt.methods()])
def test_row_35_odd_widths(precise_renderer, method: str) -> None:
    scene = soup_scene(60, 2)
    origins, directions = np.random.default_rng(3).random((2, 3075, 3)).astype(np.float32)
    with rt.Tracer(scene, method) as tracer:
        rows = tracer.trace(origins, directions)
        for width in (1, 3, 41, 1025, 3075):
            shape = (3075 // width, width)
            assert_same_bits(tracer.trace(origins, directions, shape=shape), rows)
