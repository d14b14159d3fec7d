"""Builds the documentation site from the pages of the project: `make docs`.

Sphinx makes the site from copies of the pages, including the generated parts of docs/reference. A
warning of Sphinx, such as a link without a target, is an error.
"""
from __future__ import annotations

import argparse
import importlib.util
import shutil
import sys
import tempfile
from pathlib import Path

NEEDED = ("sphinx", "furo", "myst_parser")
CONFIGURATION = Path(__file__).parent / "docsite"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", default="site", metavar="FOLDER", help="folder of the "
                        "site; default: %(default)s. The folder is replaced when the new site is "
                        "complete")
    chosen = parser.parse_args()
    missing = [name for name in NEEDED if importlib.util.find_spec(name) is None]
    if missing:
        print(f"make_site.py: {', '.join(missing)} is not installed: run "
              "`.venv/bin/python -m pip install --editable '.[docs]'`", file=sys.stderr)
        return 1
    return build(Path(chosen.output))


def build(output: Path) -> int:
    from docsite.staging import stage
    from sphinx.cmd.build import build_main
    if output.exists() and any(output.iterdir()) and not (output / "searchindex.js").exists():
        print(f"make_site.py: {output} has files, but no site; name another folder",
              file=sys.stderr)
        return 1
    with tempfile.TemporaryDirectory(prefix="gpgpu_rt_site") as folder:
        source, made = Path(folder, "source"), Path(folder, "site")
        stage(source)
        status = build_main(["-q", "-W", "--keep-going", "-b", "html", "-c", str(CONFIGURATION),
                             "-d", str(Path(folder, "doctrees")), str(source), str(made)])
        if status == 0:
            shutil.rmtree(output, ignore_errors=True)
            shutil.copytree(made, output)
            print(f"wrote {output / 'index.html'}")
    return status


if __name__ == "__main__":
    sys.exit(main())
