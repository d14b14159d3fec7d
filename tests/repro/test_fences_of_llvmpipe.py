"""In the past, traces of millions of passes sometimes ended with a damaged heap ("free():
corrupted unsorted chunks"), because llvmpipe frees fences that a thread still uses."""
from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

SOURCE = Path(__file__).with_name("fences_of_llvmpipe.c")
# The program draws without our package until llvmpipe frees a fence too early, for 10 seconds at
# most. Then it traces rays, first alone and then with an observer that reads what each pass drew.
# The program counts the fences that are freed too early during the traces.
PROGRAM = """
import ctypes, sys, time
import moderngl
library = ctypes.CDLL(sys.argv[1])
checked, freed = (ctypes.c_int.in_dll(library, name) for name in ("checked", "freed"))
context = moderngl.create_standalone_context(require=330, backend="egl")
program = context.program(
    vertex_shader='''#version 330
        void main() {
            gl_Position = vec4(4 * (gl_VertexID & 1) - 1, 2 * gl_VertexID - 1, 0, 1);
        }''',
    fragment_shader='''#version 330
        uniform sampler2D last; out vec4 colour;
        void main() { colour = texelFetch(last, ivec2(0), 0); }''')
textures = [context.texture((8, 8), 4, dtype="f4") for _ in range(2)]
targets = [context.framebuffer([texture]) for texture in textures]
triangle = context.vertex_array(program, [])
end = time.monotonic() + 10
while not freed.value and time.monotonic() < end:
    for k in range(2):
        textures[k].use()
        targets[1 - k].use()
        triangle.render(moderngl.TRIANGLES, 3)
if not freed.value:
    sys.exit()
import gpgpu_rt as rt
scene = rt.load_scene("cornell")
origins, directions = scene.camera.rays((16, 16))
for schedule in ("step", "kernels"):
    with rt.Tracer(scene, "kd-restart", schedule=schedule, mask_interval=2) as tracer:
        checked.value = freed.value = 0
        while checked.value < 1000:
            tracer.trace(origins, directions)
        print(schedule, freed.value)
        read = lambda one: [texture.read() for texture in one.outputs]
        checked.value = freed.value = 0
        while checked.value < 500:
            with tracer.observe(read):
                tracer.trace(origins, directions)
        print(schedule, "observed", freed.value)
"""


@pytest.mark.skipif(os.environ.get("GPGPU_RT_CONTEXT", "egl") != "egl", reason="needs EGL")
@pytest.mark.skipif(shutil.which("gcc") is None, reason="gcc is not installed")
def test_no_fence_is_freed_while_a_thread_uses_it(tmp_path: Path) -> None:
    library = tmp_path / "fences.so"
    subprocess.run(["gcc", "-shared", "-fPIC", "-O1", "-fno-builtin", "-o", library, SOURCE,
                    "-ldl"], check=True)
    ended = subprocess.run([sys.executable, "-c", PROGRAM, library], timeout=120, text=True,
                           capture_output=True, env={**os.environ, "LD_PRELOAD": str(library)})
    assert ended.returncode == 0, ended.stderr
    if not ended.stdout:
        pytest.skip("this renderer freed no fence too early")
    assert ended.stdout.splitlines() == ["step 0", "step observed 0", "kernels 0",
                                         "kernels observed 0"]
