"""The documentation site builds without a warning, has the whole reference, and needs no network.
"""
from __future__ import annotations

import html
import re
import subprocess
import sys
from pathlib import Path

import pytest

import gpgpu_rt as rt
from gpgpu_rt.cli.main import MODULES
from gpgpu_rt.options import TRACER_OPTIONS

ROOT = Path(rt.__file__).parents[1]
MAKE = ROOT / "tools" / "make_site.py"


def make(output: Path) -> subprocess.CompletedProcess:
    return subprocess.run([sys.executable, str(MAKE), "-o", str(output)], capture_output=True,
                          text=True, cwd=output.parent)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Returns the folder of the site. A warning of Sphinx ends the build with an error."""
    for name in ("sphinx", "furo", "myst_parser"):
        pytest.importorskip(name, reason=f"no {name} (extra: docs)")
    folder = tmp_path_factory.mktemp("docs") / "site"
    answer = make(folder)
    assert answer.returncode == 0, answer.stderr
    return folder


def text_of(page: Path) -> str:
    """Returns the words of a page of the site, without markup."""
    return " ".join(html.unescape(re.sub(r"<[^>]*>", "", page.read_text())).split())


def test_each_page_is_on_the_site_and_in_the_sidebar(site: Path) -> None:
    pages = [path.relative_to(ROOT / "docs").with_suffix(".html")
             for path in (ROOT / "docs").rglob("*.md")]
    assert len(pages) > 40
    index = (site / "index.html").read_text()
    for page in [*pages, Path("contributing.html")]:
        assert (site / page).is_file(), page
        if page.parent == Path():
            assert page.name == "index.html" or f'href="{page}"' in index, page


def test_the_reference_has_every_name(site: Path) -> None:
    reference = site / "reference"
    options = text_of(reference / "options.html")
    methods = (reference / "methods.html").read_text()
    commands = (reference / "command-line.html").read_text()
    assert all(f" {option.name} " in options for option in TRACER_OPTIONS)
    assert all(f'id="{row.name}"' in methods for row in rt.methods())
    assert all(f'id="{name}"' in commands for name in MODULES)
    assert all((reference / "api" / f"{name}.html").is_file()
               for name in rt.__all__ if name != "reference")
    assert "in units of the ray’s |direction|" in text_of(reference / "api" / "Hits.html")
    assert "between passes: its phase, and steps" in text_of(reference / "records.html")
    assert "kd_restart.glsl kd-restart: Foley and Sugerman 2005" in text_of(
        reference / "programs.html")


def test_a_page_loads_nothing_from_a_network(site: Path) -> None:
    loads = re.compile(r"<(?:script|img|link|iframe|source)\b[^>]*?(?:src|href)=\"([^\"]*)\"")
    for page in site.rglob("*.html"):
        assert not [name for name in loads.findall(page.read_text()) if "//" in name], page
    for style in site.rglob("*.css"):
        assert not re.search(r"@import|url\([\"']?https?:", style.read_text()), style
    assert "rope" in (site / "searchindex.js").read_text()


def test_a_folder_with_other_files_is_left_alone(tmp_path: Path) -> None:
    pytest.importorskip("sphinx", reason="no sphinx (extra: docs)")
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "letter.txt").write_text("dear")
    answer = make(tmp_path / "mine")
    assert answer.returncode == 1 and "name another folder" in answer.stderr
    assert answer.stderr.count("\n") == 1 and (tmp_path / "mine" / "letter.txt").exists()
