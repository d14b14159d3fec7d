"""The compiler: returns the instructions to which Mesa's softpipe driver compiles a program.

softpipe is Mesa's reference rasteriser. It prints the optimised instructions, which stand here for
the output of a compiler of 2002-2007.
"""
from __future__ import annotations

import atexit
import contextlib
import functools
import json
import os
import subprocess
import sys
import threading

from ..gl.context import open_gpu
from .program import NotCountable, parse

_MARK, _END = "### program", "### end"
_turn = threading.Lock()    # the compiler process serves one request at a time
_DEFINE = "#define TEXEL_FETCH"    # use texelFetch instead of sampling: see core/texel.glsl


def compiled(texts: list[tuple[str, str]]) -> list[str]:
    """Return the instructions of programs, given as (vertex, fragment) texts, in the same order.

    Raises
    ------
    NotCountable
        if this machine has no Mesa that prints instructions, or if Mesa refuses a program
    """
    defined = [(vertex, fragment.replace("\n", f"\n{_DEFINE}\n", 1))   # behind #version
               for vertex, fragment in texts]
    said, done = _ask(json.dumps(defined))
    found = []
    for part in said.split(_MARK)[1:]:
        _, _, text = part.partition("shader: MESA_SHADER_FRAGMENT")
        found.append(text.split("\nshader: ")[0].split("\nFRAG")[0].split("\nVERT")[0])
    if not done or len(found) != len(texts) or not all(found):
        last = (said.strip().splitlines() or ["nothing was said"])[-1]
        raise NotCountable("no instruction counts: they need the instructions that Mesa's "
                           "softpipe prints (Debian, Ubuntu: libgl1-mesa-dri), but it printed: "
                           f"{last[:200]}")
    return found


# A program with a fetch in a loop. Every compiler must report a loop that has exactly one fetch.
_PROBE = ("#version 330\nin vec2 corner;\nvoid main() { gl_Position = vec4(corner, 0, 1); }\n",
          """#version 330
uniform sampler2D table;
uniform int count;
out vec4 colour;
void main() {
    colour = vec4(0);
    for (int i = 0; i < count; i++)
        colour += texelFetch(table, ivec2(i, 0), 0);
}
""")


@functools.cache
def not_countable() -> str:
    """Return the reason why instructions cannot be counted on this machine, or "".

    A small program is compiled and parsed once per process. The driver may print no debug output,
    or print it in a form that `parse` does not know.
    """
    try:
        found = parse(*compiled([_PROBE]))
    except NotCountable as failure:
        return " ".join(str(failure).split())
    fetches = [dict(work.fetches) for work in found.work if work.fetches]
    if fetches != [{"table": 1}] or len(found.loops) != 1 or list(found.outputs) != ["colour"]:
        return ("no instruction counts: they need Mesa 22.3 (Debian 12), whose softpipe prints "
                "programs in the only form that can be read; the text of this machine's Mesa was "
                "misread")
    return ""


def check_countable() -> None:
    """Raise NotCountable if instructions cannot be counted on this machine."""
    if reason := not_countable():
        raise NotCountable(reason)


@functools.cache
def _compiler() -> subprocess.Popen[str]:
    """Return the compiler process, which runs another Mesa driver.

    The process stays open, because its start takes longer than a compilation.
    """
    where = {**os.environ, "GALLIUM_DRIVER": "softpipe", "SOFTPIPE_DEBUG": "fs",
             "LIBGL_ALWAYS_SOFTWARE": "1", "MESA_SHADER_CACHE_DISABLE": "true"}
    started = subprocess.Popen([sys.executable, "-m", __name__], text=True, env=where,
                               stdin=subprocess.PIPE, stdout=subprocess.DEVNULL,
                               stderr=subprocess.PIPE)
    atexit.register(_stop, started)
    return started


def _stop(process: subprocess.Popen[str]) -> None:
    with contextlib.suppress(BrokenPipeError), process:    # closes its pipes and waits
        process.kill()


def _ask(line: str) -> tuple[str, bool]:
    """Send a line to the compiler; return its answer, and whether the answer is complete.

    After an incomplete answer the process is stopped. Otherwise it would send the rest of this
    answer at the next request.
    """
    said: list[str] = []
    with _turn:
        process, whole = _compiler(), False
        assert process.stdin is not None and process.stderr is not None
        try:
            process.stdin.write(line + "\n")
            process.stdin.flush()
            for answer in process.stderr:
                if answer.strip() == _END:
                    whole = True
                    break
                said.append(answer)
        except BrokenPipeError:
            said += process.stderr
        finally:
            if not whole:
                _compiler.cache_clear()
                atexit.unregister(_stop)
                _stop(process)
    return "".join(said), whole


def _main() -> None:
    with open_gpu() as gpu:
        for line in sys.stdin:
            for vertex, fragment in json.loads(line):
                sys.stderr.write(_MARK + "\n")
                sys.stderr.flush()
                gpu.context.program(vertex_shader=vertex, fragment_shader=fragment).release()
            sys.stderr.write(f"\n{_END}\n")
            sys.stderr.flush()


if __name__ == "__main__":
    _main()
