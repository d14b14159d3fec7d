"""What a period compiler would be left with: programs in the instructions of Mesa's reference
rasteriser, which prints them after its own optimisation."""
from __future__ import annotations

import json
import os
import subprocess
import sys

from ..errors import ShaderError

_MARK = "### program"
_DEFINE = "#define TEXEL_FETCH"    # texels are fetched, not sampled: see common/texel.glsl


def compiled(texts: list[tuple[str, str]]) -> list[str]:
    """The instructions of programs given as (vertex, fragment) texts, in the same order.

    Raises
    ------
    ShaderError
        where this machine has no Mesa that prints them.
    """
    where = {**os.environ, "GALLIUM_DRIVER": "softpipe", "SOFTPIPE_DEBUG": "fs",
             "LIBGL_ALWAYS_SOFTWARE": "1", "MESA_SHADER_CACHE_DISABLE": "true"}
    defined = [(vertex, fragment.replace("\n", f"\n{_DEFINE}\n", 1))   # behind #version
               for vertex, fragment in texts]
    done = subprocess.run([sys.executable, "-m", __name__], input=json.dumps(defined), text=True,
                          capture_output=True, env=where, check=False)
    parts = done.stderr.split(_MARK)[1:]
    found = []
    for part in parts:
        _, _, text = part.partition("shader: MESA_SHADER_FRAGMENT")
        found.append(text.split("\nshader: ")[0].split("\nFRAG")[0].split("\nVERT")[0])
    if done.returncode or len(found) != len(texts) or not all(found):
        last = (done.stderr.strip().splitlines() or ["nothing was said"])[-1]
        raise ShaderError("no instruction counts: they are Mesa's own, printed by its softpipe "
                          f"(Debian, Ubuntu: libgl1-mesa-dri), which said: {last[:200]}")
    return found


def _main() -> None:
    from ..gpu import open_gpu
    with open_gpu() as gpu:
        for vertex, fragment in json.load(sys.stdin):
            sys.stderr.write(_MARK + "\n")
            sys.stderr.flush()
            gpu.context.program(vertex_shader=vertex, fragment_shader=fragment)


if __name__ == "__main__":
    _main()
