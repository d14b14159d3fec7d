"""Write the names of all methods to gpgpu_rt/methods/names.py, so that editors complete them.

    python tools/method_names.py [--check]

Run this program after you have added a method to this repository. With --check it writes nothing,
and its exit status is 1 if the file is not up to date.
"""
from __future__ import annotations

import argparse
import sys
from pathlib import Path

import gpgpu_rt as rt
from gpgpu_rt.methods import file_of
from gpgpu_rt.tracer import AUTO

FILE = Path(rt.__file__).parent / "methods" / "names.py"
HEAD = '''"""Names: values of the argument `method`. `tools/method_names.py` writes this file."""
from typing import Literal

MethodName = Literal[
'''


def text() -> str:
    """Return the file's text, without methods from the user's folders."""
    names = [row.name for row in rt.methods() if _is_own(row.name)]
    return HEAD + "".join(f'    "{name}",\n' for name in [AUTO, *names]) + "]\n"


def _is_own(name: str) -> bool:
    file = file_of(name)
    return file is None or Path(rt.__file__).parent in file.resolve().parents


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--check", action="store_true", help="write nothing; compare only")
    if parser.parse_args().check:
        return int(FILE.read_text(encoding="utf-8") != text())
    FILE.write_text(text(), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
