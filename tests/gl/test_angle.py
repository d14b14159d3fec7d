"""Tests of ANGLE, the OpenGL ES of Chromium: its context, the texts of its programs, its counts of
fragments, and its hits."""
from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from pathlib import Path

import moderngl
import numpy as np
import pytest
from conftest import assert_same_bits

import gpgpu_rt as rt
from gpgpu_rt.cli.main import main
from gpgpu_rt.errors import ContextError, ShaderError
from gpgpu_rt.gl import context as contexts
from gpgpu_rt.gl.angle import LIBRARIES, AngleLoader, angle_folder
from gpgpu_rt.gl.angle_text import angle_texts
from gpgpu_rt.gl.context import Gpu, open_gpu
from gpgpu_rt.gl.fragment_counter import primitives
from gpgpu_rt.gl.full_screen import FullScreenPass, Rectangles
from gpgpu_rt.gl.observation import observe
from gpgpu_rt.gl.primitive_pass import PrimitivePass
from gpgpu_rt.gl.textures import make_texture, read_texture
from gpgpu_rt.rays import ray_sets
from gpgpu_rt.statistics import Statistics

SIZE = 37, 5       # an odd width, so that rows of one 32-bit channel are not aligned to 8 bytes
HEADER = ("#version 330 core\n#extension GL_ARB_gpu_shader5 : enable\n#ifdef GL_ARB_gpu_shader5\n"
          "#define PRECISE precise\n#else\n#define PRECISE\n#endif\n")
FRAGMENT = """#version 330 core
uniform int most;
out vec4 found;
void main() {
    int x = int(gl_FragCoord.x);
    do {
        x -= 3;
    } while (x >= 3);
    if (x > most) {
        discard;
    }
    found = vec4(gl_FragCoord.xy, float(x), 1.0);
}
"""
POINTS = """#version 330 core
void main() {
    gl_Position = vec4(-0.95 + 0.1 * float(gl_VertexID % 2), -0.75, 0.0, 1.0);
}
"""


@pytest.fixture
def angle() -> Iterator[Gpu]:
    """Return the context of ANGLE, or skip the test if this machine has no ANGLE.

    Tests of ANGLE run in processes of their own, because they may disturb tests of Mesa: in the
    same process, denormals were once flushed to 0 after tests of ANGLE.
    """
    if os.environ.get("GPGPU_RT_CONTEXT") != "angle":
        pytest.skip("this process does not run on ANGLE: set GPGPU_RT_CONTEXT=angle")
    try:
        gpu = open_gpu("angle")
    except ContextError as failure:
        pytest.skip(str(failure))
    with gpu:
        yield gpu
        assert gpu.context.error == "GL_NO_ERROR"


@pytest.fixture
def counted(angle: Gpu, tmp_path: Path) -> FullScreenPass:
    (tmp_path / "counted.frag").write_text(FRAGMENT)
    return FullScreenPass(angle, str(tmp_path / "counted.frag"))


# Without ANGLE ----------------------------------------------------------------------------------


def test_missing_and_broken_libraries_get_one_line(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture) -> None:
    monkeypatch.setenv("GPGPU_RT_ANGLE", str(tmp_path))
    with pytest.raises(ContextError, match="GPGPU_RT_ANGLE is '.*', which has no libGLESv2.so"):
        AngleLoader()
    for library in LIBRARIES:
        (tmp_path / library).write_text("no library")
    assert angle_folder() == tmp_path.resolve()
    with pytest.raises(ContextError, match="cannot load ANGLE .*; set GPGPU_RT_ANGLE"):
        AngleLoader()
    for library in LIBRARIES:      # a library without functions of EGL, as in Chromium 156
        shutil.copy(np._core._multiarray_umath.__file__, tmp_path / library)
    with pytest.raises(ContextError, match="an empty stand-in without functions; set"):
        AngleLoader()
    # Bypass the cache of contexts, which must keep the contexts of other tests.
    monkeypatch.setattr(contexts, "_made", contexts._made.__wrapped__)
    picture = tmp_path / "x.png"
    assert main(["render", "cornell", "--context", "angle", "-o", str(picture)]) == 1
    error = capsys.readouterr().err
    assert "empty stand-in" in error and error.count("\n") == 1 and not picture.exists()


def test_angle_is_never_chosen_automatically(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []

    def none(backend: str) -> Gpu:
        asked.append(backend)
        raise ContextError(f"no {backend}")

    monkeypatch.setattr(contexts, "_shared", none)
    with pytest.raises(ContextError, match="no OpenGL context"):
        open_gpu("auto")
    assert asked == ["egl", "osmesa"]
    with pytest.raises(ContextError, match="no angle"):
        open_gpu("angle")


@pytest.mark.parametrize("text, told", [
    ("#define EACH(f) f(0) f(1)\n#define READ(k) texels_##k;\nEACH(READ)",
     "#define EACH(f) f(0) f(1)\n\ntexels_0; texels_1;"),
    ("#define JOIN(a, b) a##_##b + b\nfloat x = JOIN(p, q(1, (2)));",
     "\nfloat x = p_q(1, (2)) + q(1, (2));"),
    ("uniform int most;\nint limit = max(most, 0);",
     "uniform int most;\n#define limit (max(most, 0))")])
def test_joined_names_and_globals(text: str, told: str) -> None:
    _, fragment = angle_texts(HEADER, HEADER + text + "\n")
    assert f"\n{told}\n" in fragment
    # Lines keep their numbers, so that a message names the right line of a file.
    assert fragment.splitlines().index(told.splitlines()[-1]) == (
        (HEADER + text).splitlines().index(text.splitlines()[-1]))


def test_a_joining_macro_that_another_macro_calls_is_refused() -> None:
    with pytest.raises(ShaderError, match="another macro calls"):
        angle_texts(HEADER, HEADER + "#define A(k) a_##k\n#define B(k) A(k)\nfloat x = B(0);\n")


def test_primitives_of_a_draw() -> None:
    counts = {moderngl.POINTS: 7, moderngl.LINES: 3, moderngl.LINE_STRIP: 6,
              moderngl.TRIANGLES: 2, moderngl.TRIANGLE_STRIP: 5, moderngl.TRIANGLE_FAN: 5}
    assert {mode: primitives(mode, 7) for mode in counts} == counts
    assert primitives(moderngl.TRIANGLE_STRIP, 1) == primitives(moderngl.LINE_STRIP, 0) == 0


# With ANGLE -------------------------------------------------------------------------------------


def test_fragments_are_counted_as_in_opengl(angle: Gpu, counted: FullScreenPass) -> None:
    """Fragments that are discarded, or that fail the depth test, do not count."""
    drawn = make_texture(angle, SIZE, 4, "drawn")
    depth = angle.context.depth_renderbuffer(SIZE)
    target = angle.context.framebuffer([drawn], depth)
    some = Rectangles(angle)
    some.write(np.array([[0, 0, 10, 3], [5, 0, 10, 2]], np.float32))   # 30 texels, 10 twice
    x = (np.arange(SIZE[0]) % 3) + np.where(np.arange(SIZE[0]) < 3, -3, 0)
    for most, rectangles in ((2, None), (0, None), (-9, None), (2, some)):
        target.clear(depth=1.0)
        counted.set(most=most)
        statistics = Statistics()
        expected = 40 if rectangles else SIZE[1] * int((x <= most).sum())
        assert counted.count(target, {}, statistics, rectangles=rectangles) == expected
    values = read_texture(drawn)
    assert np.array_equal(values[:3, :10, 2], np.broadcast_to(x[:10], (3, 10)))
    target.clear(depth=1.0)
    angle.context.enable_only(moderngl.DEPTH_TEST)
    angle.context.depth_func = "<"
    counted.set(most=1)
    first = counted.count(target, {}, statistics, depth=0.5)
    counted.set(most=2)
    assert counted.count(target, {}, statistics, depth=0.5) == SIZE[0] * SIZE[1] - first > 0
    assert counted.count(target, {}, statistics, depth=0.5) == 0
    angle.context.enable_only(moderngl.NOTHING)


def test_a_query_counts_several_draws_of_any_size(angle: Gpu, counted: FullScreenPass) -> None:
    targets = [angle.context.framebuffer([make_texture(angle, size, 1, "drawn")])
               for size in ((4, 4), (9, 2), (4, 4))]
    counted.set(most=2)
    with (query := angle.query()):
        for target in targets:
            counted.draw(target, {})
    with (none := angle.query()):
        pass
    counted.draw(targets[0], {})     # outside of a query
    assert (query.samples, none.samples) == (16 + 18 + 16, 0)


def test_counts_begin_at_0_in_memory_that_held_other_values(
        angle: Gpu, counted: FullScreenPass) -> None:
    """Counts begin at 0, even if the memory of the counts contained infinities. The render target
    is smaller than the viewport."""
    size = 4096, 2
    counted.set(most=2)
    for _ in range(3):
        used = [make_texture(angle, size, 1, "infinite", np.full((*size[::-1], 1), np.inf))
                for _ in range(20)]
        for one in used:
            read_texture(one)
            one.release()
        angle.finish()
        drawn = angle.context.framebuffer([make_texture(angle, (10, 6), 4, "drawn")])
        drawn.viewport = 0, 0, *size
        assert counted.count(drawn, {}, Statistics()) == 20


def test_points_of_one_texel_are_counted(angle: Gpu, tmp_path: Path) -> None:
    (tmp_path / "points.vert").write_text(POINTS)
    (tmp_path / "points.frag").write_text("#version 330 core\nout float one;\n"
                                          "void main() { one = 1.0; }\n")
    points = PrimitivePass(angle, str(tmp_path / "points.frag"), str(tmp_path / "points.vert"))
    drawn = make_texture(angle, (20, 4), 1, "drawn")
    target = angle.context.framebuffer([drawn])
    target.clear()
    with observe(angle, fragments=True) as passes:
        points.draw(target, {}, moderngl.POINTS, 6)
    assert (passes[0].fragments, passes[0].primitives) == (6, 6)
    assert read_texture(drawn).sum() == 2        # three points fall into each of two texels


def test_the_context_names_its_largest_point(angle: Gpu, tmp_path: Path) -> None:
    smallest, largest = angle.context.info["GL_POINT_SIZE_RANGE"]
    assert smallest == 1 and largest >= 64
    (tmp_path / "large.vert").write_text(
        "#version 330 core\nvoid main() {\n    gl_PointSize = 65.0;\n"
        "    gl_Position = vec4(0.0, 0.0, 0.0, 1.0);\n}\n")
    (tmp_path / "large.frag").write_text("#version 330 core\nout float one;\n"
                                         "void main() { one = 1.0; }\n")
    point = PrimitivePass(angle, str(tmp_path / "large.frag"), str(tmp_path / "large.vert"))
    drawn = make_texture(angle, (75, 75), 1, "drawn")
    target = angle.context.framebuffer([drawn])
    target.clear()
    point.draw(target, {}, moderngl.POINTS, 1)
    assert read_texture(drawn).sum() == 65 ** 2


def test_eight_targets(angle: Gpu, counted: FullScreenPass, tmp_path: Path) -> None:
    """The last of the eight targets usually contains the counts of fragments. If a program draws
    into all eight targets, no target is free for counts, so each draw counts as the whole
    viewport. Counts of other draws do not get into the eight targets."""
    outputs = "".join(f"layout(location = {at}) out float out_{at};\n" for at in range(8))
    values = "".join(f"out_{at} = {at}.5; " for at in range(8))
    (tmp_path / "eight.frag").write_text(
        f"#version 330 core\n{outputs}void main() {{ {values}}}\n")
    eight = FullScreenPass(angle, str(tmp_path / "eight.frag"))
    drawn = [make_texture(angle, SIZE, 1, "drawn") for _ in range(8)]
    target = angle.context.framebuffer(drawn)
    counted.set(most=2)
    with (query := angle.query()):
        counted.draw(angle.context.framebuffer([make_texture(angle, (4, 3), 4, "one")]), {})
        eight.draw(target, {})
        eight.draw(target, {})
    assert query.samples == 4 * 3 + 2 * SIZE[0] * SIZE[1]
    eight.draw(target, {})
    assert [float(read_texture(one).max()) for one in drawn] == [at + 0.5 for at in range(8)]


def test_masks_of_single_targets_and_readbacks(angle: Gpu) -> None:
    for components, dtype in ((1, "f4"), (2, "f4"), (4, "f4"), (3, "f4"), (4, "u4"), (4, "f2")):
        values = np.arange(SIZE[0] * SIZE[1] * components).reshape(SIZE[1], SIZE[0], components)
        texture = make_texture(angle, SIZE, components, "values", values, dtype)
        assert np.array_equal(read_texture(texture), values.astype(np.float32))
    pair = [make_texture(angle, SIZE, 4, "pair") for _ in range(2)]
    target = angle.context.framebuffer(pair)
    target.clear()
    target.color_mask = (True,) * 4, (False,) * 4
    target.clear(7.0, 7.0, 7.0, 7.0)
    assert [float(read_texture(one).max()) for one in pair] == [7, 0]


def test_infinity_in_a_half_float_target(angle: Gpu, tmp_path: Path) -> None:
    """SwiftShader stores an infinity as a NaN in a half-float target. An entry of
    tests/angle_exceptions.py names this fault. If this test fails, the fault is repaired: delete
    the entry."""
    (tmp_path / "infinity.frag").write_text(
        "#version 330 core\nout vec4 a;\n"
        "void main() { a = vec4(uintBitsToFloat(0x7f800000u)); }\n")
    drawn = {}
    for dtype in ("f2", "f4"):
        texture = angle.context.texture(SIZE, 4, dtype=dtype)
        FullScreenPass(angle, str(tmp_path / "infinity.frag")).draw(
            angle.context.framebuffer([texture]), {})
        drawn[dtype] = float(np.frombuffer(texture.read(), "<" + dtype)[0])
    assert np.isnan(drawn["f2"]) and drawn["f4"] == np.inf


def test_a_missing_function_is_an_error_of_gl(angle: Gpu) -> None:
    angle.context.wireframe = False      # ANGLE has this function under another name
    assert angle.context.error == "GL_NO_ERROR"
    angle.context.point_size = 2.0
    assert angle.context.error == "GL_INVALID_OPERATION"
    assert angle.context.error == "GL_NO_ERROR"


def test_a_compile_error_names_the_line(angle: Gpu, tmp_path: Path) -> None:
    (tmp_path / "wrong.frag").write_text("#version 330 core\nout vec4 a;\n\nvoid main() { a = b; "
                                         "}\n")
    with pytest.raises(ShaderError, match=r"wrong\.frag:4: .*'b'"):
        FullScreenPass(angle, str(tmp_path / "wrong.frag"))


@pytest.mark.parametrize("method, settings", [
    ("kd-restart", {"schedule": "kernels"}), ("kd-packet", {"schedule": "loop"}),
    ("kd-ropes-packet", {"schedule": "loop", "packet": (4, 4)}),
    ("bvh-packet", {"schedule": "loop", "entry_points": 8}), ("kd-restart", {"entry_points": 4}),
    ("bvh-packet", {"schedule": "step"}), ("bvh-packet", {"schedule": "step", "packet": (4, 2)}),
    ("geometry-image", {}), ("ray-engine", {}), ("ray-tiles", {}), ("ray-classification", {})])
def test_hits_have_the_bits_of_mesa(angle: Gpu, method: str, settings: dict) -> None:
    scene = rt.load_scene("cornell")
    found = []
    for context in (angle, open_gpu("auto")):
        with rt.Tracer(scene, method, context=context, **settings) as tracer:
            found.append((tracer.trace(*ray_sets.random_rays(scene, 6000, 2)),
                          tracer.statistics))
    (hits, statistics), (expected, mesa) = found
    assert expected.hit.any()
    assert_same_bits(hits, expected)
    assert (statistics.passes, statistics.live) == (mesa.passes, mesa.live)


@pytest.mark.parametrize("method", ["kd-restart", "kd-packet"])
def test_the_era_form_needs_desktop_opengl(angle: Gpu, method: str) -> None:
    with pytest.raises(rt.OptionError, match="needs desktop OpenGL"):
        with rt.Tracer("cornell", method, era="r580" if method == "kd-packet" else "r420",
                       context=angle) as tracer:
            tracer.trace(*tracer.scene.camera.rays((4, 4)))
