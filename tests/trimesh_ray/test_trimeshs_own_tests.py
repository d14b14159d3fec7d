"""Runs trimesh's published ray tests with our engine in place of trimesh's engines.

The tests belong to trimesh and are not in this repository. TRIMESH_TESTS names the folder that
holds test_ray.py, from a checkout or from the source distribution of the installed release
(``pip download --no-deps --no-binary :all: trimesh==VERSION``).
"""
from __future__ import annotations

import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

VARIABLE = "TRIMESH_TESTS"
FILES = ("test_ray.py", "test_ray_upstream.py")  # trimesh 5 added the second file
PLUGIN = "ours_in_trimesh"


def published() -> list[Path]:
    """Returns trimesh's test files. Skips the test if TRIMESH_TESTS is not set."""
    folder = os.environ.get(VARIABLE)
    if not folder:
        pytest.skip(f"set {VARIABLE} to the folder with trimesh's test_ray.py")
    files = [path for path in (Path(folder).resolve() / name for name in FILES) if path.exists()]
    assert files, f"{VARIABLE}={folder} holds no test_ray.py"
    return files


@pytest.mark.full
@pytest.mark.parametrize("method", ["bvh-threaded", "kd-short-stack", "grid", "bvh-packet"])
def test_ours_passes_trimeshs_ray_tests(method: str) -> None:
    files, left_out = published(), []
    if importlib.util.find_spec("manifold3d") is None:
        # The deselected test cuts a hole with manifold3d.
        left_out = ["--deselect", f"{files[0].name}::test_contains_cavity"]
    here = str(Path(__file__).parent)
    answer = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", PLUGIN, "-p", "no:cacheprovider", "-c",
         os.devnull, "--rootdir", str(files[0].parent), *left_out, *(path.name for path in files)],
        cwd=files[0].parent, capture_output=True, text=True,
        env={**os.environ, "PYTHONPATH": here, "OURS_IN_TRIMESH": method})
    assert answer.returncode == 0, answer.stdout[-4000:] + answer.stderr[-2000:]
    passed = int(re.search(r"(\d+) passed", answer.stdout)[1])
    asked = int(re.search(r"queries answered by gpgpu_rt: (\d+)", answer.stdout)[1])
    print(f"{passed} tests passed, {asked} queries by {method}"
          + (", test_contains_cavity left out: no manifold3d" if left_out else ""))
    assert passed >= 10 and asked >= passed
