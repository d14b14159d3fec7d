"""Calls GLSL functions on arrays: a full-screen pass runs a GLSL body for every row."""
from __future__ import annotations

import tempfile
from pathlib import Path

import moderngl
import numpy as np

from gpgpu_rt.gl.context import open_gpu
from gpgpu_rt.gl.full_screen import FullScreenPass
from gpgpu_rt.gl.textures import make_texture

WIDTH = 1024


def evaluate(include: str, body: str, values: np.ndarray) -> np.ndarray:
    """Return the (n, 4) results of a GLSL body that computes ``result`` from ``x``.

    ``x`` is a row of ``values``, (n, up to 4). Input and result are both float32 or both uint32.
    The body may call the functions of ``render/{include}.glsl``.
    """
    gpu, whole = open_gpu(), values.dtype == np.uint32
    count = len(values)
    rows = -(-count // WIDTH)
    padded = np.ones((rows * WIDTH, 4), np.uint32 if whole else np.float32)
    padded[:count, :values.shape[1]] = values
    kind, prefix = ("u4", "u") if whole else ("f4", "")
    with tempfile.TemporaryDirectory() as folder, gpu:
        probe = Path(folder) / "probe.frag"
        probe.write_text(f'#version 330 core\n#include "core/precision.glsl"\n'
                         f'#include "render/{include}.glsl"\n'
                         f"uniform {prefix}sampler2D values;\nout {prefix}vec4 result;\n"
                         "void main() {\n"
                         f"    {prefix}vec4 x = texelFetch(values, ivec2(gl_FragCoord.xy), 0);\n"
                         f"    {body}\n}}\n")
        shader = FullScreenPass(gpu, str(probe))
        texture = make_texture(gpu, (WIDTH, rows), 4, "values",
                               padded.reshape(rows, WIDTH, 4), kind)
        drawn = make_texture(gpu, (WIDTH, rows), 4, "probe", dtype=kind)
        target = gpu.context.framebuffer([drawn])
        gpu.context.enable_only(moderngl.NOTHING)
        shader.draw(target, {"values": texture})
        result = np.frombuffer(drawn.read(), padded.dtype).reshape(-1, 4)[:count].copy()
        gpu.release(target)
        for part in (texture, drawn, shader):
            part.release()
    return result
