"""In the past, Python imported a folder named gpgpu_rt in the current folder instead of the
package. So the package was empty in the folder that contains the checkout."""
from __future__ import annotations

import subprocess
import sys
from pathlib import Path


def test_a_folder_of_the_packages_name_does_not_hide_the_package(tmp_path: Path) -> None:
    (tmp_path / "gpgpu_rt").mkdir()
    code = ("import gpgpu_rt; gpgpu_rt.load_scene; "
            "import gpgpu_rt.figures; print(gpgpu_rt.__file__)")
    found = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True,
                           text=True)
    assert found.returncode == 0, found.stderr
    assert found.stdout.strip().endswith("__init__.py")
