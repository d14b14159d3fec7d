"""Runs the tests headless: `make test` on one backend, `make test-all` on all backends."""
from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile

# zink is Mesa's OpenGL over Vulkan. Vulkan uses llvmpipe, so hits equal llvmpipe's to the bit.
ZINK = {"MESA_LOADER_DRIVER_OVERRIDE": "zink", "GALLIUM_DRIVER": "zink",
        "LIBGL_ALWAYS_SOFTWARE": "1",
        # Without this variable, Vulkan's loader prints a line to stderr.
        "XDG_RUNTIME_DIR": os.environ.get("XDG_RUNTIME_DIR") or tempfile.gettempdir()}
# The tests that compare hits.
HITS = [f"tests/{path}" for path in (
    "traversal", "methods", "session", "inspect", "extremes", "reference", "repro",
    "render/image_space", "gl/test_formats.py")]
FRESH = ("bookworm", "trixie")
NOT_HERE = 77      # exit status of tools/fresh_machine.sh if no fresh machine can be made


def renderer_of(backend: str, **environment: str) -> str:
    """Return a backend's renderer, or "" without a context."""
    probe = ("import sys; from gpgpu_rt.gl.context import open_gpu; "
             "print(open_gpu(sys.argv[1]).renderer)")
    answer = subprocess.run([sys.executable, "-c", probe, backend], capture_output=True,
                            text=True, env={**os.environ, **environment})
    return answer.stdout.strip() if answer.returncode == 0 else ""


def backends() -> dict[str, str]:
    return {backend: renderer_of(backend) for backend in ("osmesa", "egl")}


# Tests spend most time in Python, so a process per core halves the time on two cores.
AT_ONCE = ["-n", "auto", "--dist", "worksteal"]


def run(title: str, backend: str, arguments: list[str], **environment: str) -> int:
    print(f"== {title}", flush=True)
    return subprocess.call([sys.executable, "-m", "pytest", *AT_ONCE, *arguments],
                           env={**os.environ, "GPGPU_RT_CONTEXT": backend, **environment})


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--all", action="store_true", help="all tests at full size on every "
                        "renderer; parts of them on softpipe, zink, ANGLE, fresh machines")
    parser.add_argument("pytest", nargs="*", help="arguments for pytest")
    chosen = parser.parse_args()
    found = backends()
    there = [backend for backend, renderer in found.items() if renderer]
    if not there:
        print("No OpenGL context: install libegl1 libgl1 libgl1-mesa-dri (or libosmesa6), "
              "then `gpgpu-rt info`", file=sys.stderr)
        return 1
    if not chosen.all:
        first = there[0]
        return run(f"quick suite on {first}: {found[first]}", first,
                   ["-m", "not full", *chosen.pytest])
    failed = 0
    for backend, renderer in found.items():
        if not renderer:
            print(f"== SKIPPED: {backend} has no context on this machine", flush=True)
        elif backend == there[-1] or renderer != found[there[-1]]:
            failed |= run(f"everything on {backend}: {renderer}", backend, chosen.pytest)
        else:
            failed |= run(f"full sizes on {backend}: {renderer}, without tests marked `once`; "
                          f"{there[-1]} has the same renderer and runs them", backend,
                          ["-m", "not once", *chosen.pytest])
    if found["egl"]:
        failed |= run("tests marked small, on EGL with softpipe", "egl",
                      ["-m", "small", *chosen.pytest], GALLIUM_DRIVER="softpipe")
    zink = renderer_of("egl", **ZINK)
    if zink.startswith("zink"):
        failed |= run(f"hits on EGL with {zink}", "egl", ["-m", "not full", *HITS, *chosen.pytest],
                      **ZINK)
    else:
        print("== SKIPPED: EGL has no zink on this machine (mesa-vulkan-drivers)", flush=True)
    if renderer_of("angle"):
        failed |= run("the context of ANGLE over SwiftShader", "angle",
                      ["tests/gl/test_angle.py", *chosen.pytest])
        failed |= run("hits on ANGLE over SwiftShader", "angle",
                      ["-m", "not full", *HITS, *chosen.pytest])
    else:
        print("== SKIPPED: this machine has no ANGLE over SwiftShader (tools/angle_libraries.sh)",
              flush=True)
    for suite in FRESH if not chosen.pytest else ():
        print(f"== a fresh Debian {suite}", flush=True)
        status = subprocess.call(["tools/fresh_machine.sh", suite])
        failed |= status not in (0, NOT_HERE)
    return int(bool(failed))


if __name__ == "__main__":
    sys.exit(main())
