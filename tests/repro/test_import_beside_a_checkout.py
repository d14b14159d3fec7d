"""In the past, if the current folder contained a folder named gpgpu_rt, such as a checkout, Python
imported that folder instead of the package."""
from __future__ import annotations

import os
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

import gpgpu_rt

LIBRARIES = Path(sysconfig.get_path("purelib"))


def test_a_folder_of_the_packages_name_does_not_hide_the_package(tmp_path: Path) -> None:
    installed = LIBRARIES in Path(gpgpu_rt.__file__).parents
    if not installed and not (LIBRARIES / "gpgpu_rt_checkout.pth").exists():
        pytest.skip("`make setup` did not make this environment")
    (tmp_path / "gpgpu_rt").mkdir()
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    code = ("import gpgpu_rt; gpgpu_rt.load_scene; "
            "import gpgpu_rt.figures; print(gpgpu_rt.__file__)")
    found = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True,
                           text=True, env=environment)
    assert found.returncode == 0, found.stderr
    assert found.stdout.strip().endswith("__init__.py")
