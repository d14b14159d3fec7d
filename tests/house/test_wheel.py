"""A wheel contains every file that the commands read, so the commands run without a checkout."""
from __future__ import annotations

import configparser
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import gpgpu_rt as rt

ROOT = Path(rt.__file__).parents[1]
FOLDERS = {"gpgpu_rt": "gpgpu_rt", "glsl": "gpgpu_rt.glsl", "figures": "gpgpu_rt.figures"}
MADE = ("figures/out", "figures/data")      # made by `make figures`


def config() -> configparser.ConfigParser:
    found = configparser.ConfigParser()
    found.read(ROOT / "setup.cfg")
    return found


def data_files() -> set[Path]:
    """Returns the files of the package's folders that are not Python."""
    return {path for folder in FOLDERS for path in (ROOT / folder).rglob("*") if path.is_file()
            and path.suffix not in (".py", ".pyc")
            and not str(path.relative_to(ROOT)).startswith(MADE)}


def listed_files() -> set[Path]:
    """Returns the files that setup.cfg puts into a wheel in addition to Python files."""
    return {path for package, patterns in config()["options.package_data"].items()
            for pattern in patterns.replace(",", "\n").split()
            for path in _folder_of(package).glob(pattern) if path.is_file()}


def _folder_of(package: str) -> Path:
    for folder, name in FOLDERS.items():
        if name != "gpgpu_rt" and (package + ".").startswith(name + "."):
            return ROOT.joinpath(folder, *package.split(".")[2:])
    return ROOT.joinpath(*package.split("."))


def test_every_data_file_is_installed() -> None:
    files = data_files()
    assert {path.suffix for path in files} >= {".frag", ".glsl", ".js", ".css", ".csv", ".bib",
                                               ".json", ".c", ".typed"}
    assert files - listed_files() == set()


def test_every_pattern_finds_a_file() -> None:
    for package, patterns in config()["options.package_data"].items():
        for pattern in patterns.replace(",", "\n").split():
            assert any(_folder_of(package).glob(pattern)), (package, pattern)


@pytest.fixture(scope="module")
def installed(tmp_path_factory) -> Iterator[Path]:
    """Yields a folder with the files that an installed wheel has. The folder is filled by
    ``build_py``, the command that makes the content of a wheel."""
    pytest.importorskip("setuptools", reason="no setuptools, so no wheel can be made")
    tree, target = tmp_path_factory.mktemp("tree"), tmp_path_factory.mktemp("installed")
    for name in ("setup.cfg", "pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, tree)
    for folder in FOLDERS:
        shutil.copytree(ROOT / folder, tree / folder, ignore=shutil.ignore_patterns(
            "__pycache__", *(name.split("/")[1] for name in MADE)))
    subprocess.run([sys.executable, "-c", "from setuptools import setup; setup()", "-q",
                    "build_py", "--build-lib", str(target)], cwd=tree, check=True,
                   capture_output=True)
    shutil.rmtree(tree)
    yield target


def run(installed: Path, folder: Path, *words: str) -> subprocess.CompletedProcess:
    """Runs Python in ``folder``, where `gpgpu_rt` is imported from the installed files."""
    paths = {"PYTHONPATH": str(installed), "GPGPU_RT_SCENES": str(folder)}
    return subprocess.run([sys.executable, *words], capture_output=True, text=True, cwd=folder,
                          env={**os.environ, **paths})


@pytest.mark.parametrize("words, wanted", [
    ("render cornell --size 16 -o {}/a.png", "wrote"),
    ("render cornell-light --integrator path --samples 2 --size 8 -o {}/a.png", "wrote"),
    ("web cornell -o {}/a.html", "a.html"),
    ("methods kd-restart", "glsl/methods/kdtree/kd_restart.glsl"),
    ("methods", "kd-restart"),
    ("scenes", "cornell"),
    ("program bvh-packet", "void main"),
    ("heat cornell -m grid --size 16 -o {}/a.png", "median"),
    ("hardware", "2004"),
    ("conform --list", "grazing")])
def test_commands_run_without_a_checkout(installed: Path, tmp_path: Path, words: str,
                                         wanted: str) -> None:
    done = run(installed, tmp_path, "-m", "gpgpu_rt", *words.format(tmp_path).split())
    assert done.returncode == 0 and wanted in done.stdout, done.stderr or done.stdout


def test_the_installed_package_needs_no_checkout(installed: Path, tmp_path: Path) -> None:
    """The installed package imports no file of the checkout. The advice on a missing extra names
    the wheel, because there is no checkout."""
    code = ("import sys, gpgpu_rt as rt, gpgpu_rt.figures\nfrom gpgpu_rt.cli import main\n"
            "main(['render', 'cornell', '--size', '8', '-o', 'a.png'])\n"
            "from gpgpu_rt.errors import how_to_install\nprint(how_to_install('view'))\n"
            "print({m.__file__ for n, m in sys.modules.items() if n.startswith('gpgpu_rt') and\n"
            f"       not (m.__file__ or '').startswith({str(installed)!r})}})")
    done = run(installed, tmp_path, "-c", code)
    *_, how, outside = done.stdout.splitlines()
    assert outside == "set()", done.stderr
    assert how == "pip install 'WHEEL[view]', where WHEEL is the file of this package's wheel"
