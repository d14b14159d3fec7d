"""Tests of passes: uniforms, missing inputs, observation, fragment counts, and the release of GL
objects."""
from __future__ import annotations

from pathlib import Path

import moderngl
import numpy as np
import pytest

import gpgpu_rt as rt
from gpgpu_rt.errors import Error, ShaderError
from gpgpu_rt.gl.context import Gpu
from gpgpu_rt.gl.full_screen import FullScreenPass
from gpgpu_rt.gl.observation import observe
from gpgpu_rt.gl.textures import make_texture, read_texture, release
from gpgpu_rt.statistics import Statistics
from gpgpu_rt.traversal.driver import Driver, Setup
from gpgpu_rt.traversal.own_arrays import _kept

pytestmark = pytest.mark.small

TEXT = ("#version 330 core\nuniform sampler2D values;\nuniform float factor;\nout vec4 result;\n"
        "void main() {\n    result = factor * texelFetch(values, ivec2(gl_FragCoord.xy), 0);\n"
        "    if (result.x < 4.0) {\n        discard;\n    }\n}\n")


@pytest.fixture
def doubled(gpu: Gpu, tmp_path: Path) -> FullScreenPass:
    """Return a pass that multiplies texels by the uniform ``factor`` and discards results below
    4."""
    (tmp_path / "probe.frag").write_text(TEXT)
    return FullScreenPass(gpu, str(tmp_path / "probe.frag"))


def test_passes_of_the_same_text_have_separate_uniforms(gpu: Gpu, doubled) -> None:
    values = np.arange(8, dtype=np.float32).reshape(1, 8, 1)
    texture = make_texture(gpu, (8, 1), 1, "values", values)
    target = gpu.context.framebuffer([make_texture(gpu, (8, 1), 1, "result")])
    other = FullScreenPass(gpu, doubled.name)
    doubled.set(factor=2.0, compiled_away=1.0)
    other.set(factor=3.0)
    for one, factor in ((doubled, 2), (other, 3), (doubled, 2)):
        target.clear()
        statistics = Statistics()
        kept = one.count(target, {"values": texture}, statistics)
        expected = np.where(factor * values >= 4, factor * values, 0)
        assert np.array_equal(read_texture(target.color_attachments[0]), expected)
        assert (kept, statistics.queries) == (np.count_nonzero(expected), 1)


def test_a_texture_that_is_missing_or_drawn_into_is_refused(gpu: Gpu, doubled) -> None:
    texture = make_texture(gpu, (2, 2), 4, "both")
    with pytest.raises(Error, match="samples values, which was not given"):
        doubled.draw(gpu.context.framebuffer([texture]), {"value": texture})
    with pytest.raises(Error, match="samples values while drawing into it"):
        doubled.draw(gpu.context.framebuffer([texture]), {"values": texture})


def test_observing_ends_with_its_block_also_within_another(gpu: Gpu, doubled) -> None:
    texture, target = make_texture(gpu, (2, 2), 4, "values"), make_texture(gpu, (2, 2), 4, "drawn")
    framebuffer = gpu.context.framebuffer([target])

    def draw() -> None:
        doubled.draw(framebuffer, {"values": texture})
    with observe(gpu) as outer:
        draw()
        with pytest.raises(KeyError), observe(gpu, lambda one: draw()) as inner:
            assert gpu.observers.all == [outer, inner]
            draw()      # draws of the callback are not observed
            raise KeyError
        draw()
    draw()
    assert not gpu.observers
    assert [one.number for one in outer] == [0, 1, 2] and [one.number for one in inner] == [0]
    assert outer[0].fragments is None and outer[0].inputs == {"values": texture}


def test_observed_fragments_equal_the_hosts_own_count(gpu: Gpu, doubled) -> None:
    values = np.arange(48, dtype=np.float32).reshape(3, 4, 4)
    texture, statistics = make_texture(gpu, (4, 3), 4, "values", values), Statistics()
    framebuffer, seen = gpu.context.framebuffer([make_texture(gpu, (4, 3), 4, "drawn")]), []
    doubled.set(factor=1.0)
    with observe(gpu, lambda one: seen.append(one.fragments), fragments=True) as passes:
        kept = doubled.count(framebuffer, {"values": texture}, statistics)
        doubled.draw(framebuffer, {"values": texture})
    assert seen == [one.fragments for one in passes] == [kept, 11] == [11, 11]
    drawn = 0 if "softpipe" in gpu.renderer else 1      # softpipe counts no primitives
    assert [one.primitives for one in passes] == [drawn, drawn]


def test_release_accepts_nested_containers(gpu: Gpu) -> None:
    """`release` accepts None and objects of OpenGL, also inside dicts, lists and iterators."""
    textures = [make_texture(gpu, (2, 2), 4, "kept") for _ in range(4)]
    target = gpu.context.framebuffer(textures[:1])
    target.use()
    release(None, target, {"a": textures[0], "b": [textures[1], None]}, (t for t in textures[2:]))
    for part in (target, *textures):
        assert isinstance(part.mglo, moderngl.InvalidObject)
    gpu.context.framebuffer([make_texture(gpu, (2, 2), 4, "next")]).clear(1.0)   # no GL error


def test_renderers_that_mix_up_local_arrays_are_detected(gpu: Gpu, monkeypatch) -> None:
    """Each fragment has its own copy of a local array of the program. Neighbouring fragments can
    write into their copies at different indices. softpipe then mixes up the copies; llvmpipe does
    not. If a renderer mixes up the copies, methods that need such arrays are refused, and other
    methods run."""
    assert _kept(gpu) == ("softpipe" not in gpu.renderer)
    monkeypatch.setattr(gpu, "keeps_own_arrays", False)
    for method, options in (("kd-stack", {}), ("bvh-stack", {}), ("bih", {"stack_size": 4})):
        with pytest.raises(rt.LimitError, match=f"^{method} keeps .*use a method without a stack"):
            rt.Tracer("cornell", method, **options)
    for method, options in (("bvh-packet", {"octants": True}), ("bih", {}),
                            ("bvh-stack", {"schedule": "step"}), ("kd-short-stack", {})):
        rt.Tracer("cornell", method, **options).release()


def test_a_tracer_that_cannot_be_made_frees_its_tables(monkeypatch: pytest.MonkeyPatch) -> None:
    """The caller may try another method, which needs the memory."""
    held = []

    def fails(setup: Setup) -> Driver:
        held.extend(setup.samplers.values())
        raise ShaderError("it does not compile")
    monkeypatch.setattr("gpgpu_rt.session.session.make_driver", fails)
    with pytest.raises(ShaderError):
        rt.Tracer(rt.load_scene("cornell"), "kd-restart")
    assert held and all(isinstance(texture.mglo, moderngl.InvalidObject) for texture in held)
