"""In the past, `gpgpu-rt info` crashed if the environment chose the driver zink, because OSMesa of
Mesa 22.3 crashes with zink."""
from __future__ import annotations

import os
import subprocess
import sys


def test_info_says_that_osmesa_has_no_zink() -> None:
    answer = subprocess.run(
        [sys.executable, "-m", "gpgpu_rt", "info"], capture_output=True, text=True,
        env={**os.environ, "GALLIUM_DRIVER": "zink", "MESA_LOADER_DRIVER_OVERRIDE": "zink",
             "LIBGL_ALWAYS_SOFTWARE": "1"})
    assert answer.returncode in (0, 1), answer.stderr
    assert "osmesa: not available (OSMesa has no driver zink" in answer.stdout
