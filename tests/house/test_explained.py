"""The interface explains itself: docstrings list the options, and names can be completed."""
from __future__ import annotations

import pydoc
import re
import subprocess
import sys
from pathlib import Path
from typing import Literal, get_args, get_origin, get_type_hints

import gpgpu_rt as rt
from gpgpu_rt.methods import find_method
from gpgpu_rt.methods.names import MethodName
from gpgpu_rt.options import TRACER_OPTIONS, Option, lists
from gpgpu_rt.tracer import AUTO

ROOT = Path(rt.__file__).parents[1]
TOOL = ROOT / "tools" / "method_names.py"


def test_the_names_of_methods_are_up_to_date() -> None:
    done = subprocess.run([sys.executable, str(TOOL), "--check"])
    assert done.returncode == 0, "run `python tools/method_names.py`"


def test_the_names_are_those_of_methods() -> None:
    first, *names = get_args(MethodName)
    assert first == AUTO and len(names) > 20 and all(find_method(name) for name in names)
    hint = get_type_hints(rt.Tracer.__init__)["method"]
    assert {*get_args(MethodName)} <= {name for kind in get_args(hint)
                                       if get_origin(kind) is Literal for name in get_args(kind)}


def test_the_tool_notices_an_old_file(tmp_path: Path) -> None:
    code = (f"import runpy, sys, pathlib; sys.argv = ['x', *sys.argv[2:]]\n"
            f"tool = runpy.run_path({str(TOOL)!r}); main = tool['main']\n"
            f"main.__globals__['FILE'] = pathlib.Path({str(tmp_path / 'names.py')!r})\n"
            "sys.exit(main())")

    def run(*words: str) -> int:
        return subprocess.run([sys.executable, "-c", code, "x", *words]).returncode
    (tmp_path / "names.py").write_text("MethodName = str\n")
    assert run("--check") == 1 and run() == 0 and run("--check") == 0
    told = (tmp_path / "names.py").read_text()
    assert told == (ROOT / "gpgpu_rt" / "methods" / "names.py").read_text()


def test_help_of_a_tracer_lists_its_options() -> None:
    text = pydoc.render_doc(rt.Tracer, renderer=pydoc.plaintext)
    for option in TRACER_OPTIONS:
        entry = re.search(rf"^ \|  {option.name} : (.+)\n((?: \|      .*\n)+)", text, re.M)
        assert entry, option.name
        assert " ".join(entry[2].replace(" | ", "").split()) == option.help
        assert all(repr(choice) in entry[1] for choice in option.choices or ())
        assert ("; default" in entry[1]) == ("default:" not in option.help)
    for name in ("scene", "method", "options"):
        assert re.search(rf"^ \|  {name} : ", text, re.M)
    assert "schedule : 'kernels' or 'step' or 'loop'; default 'loop'" in text
    assert "step_cap : int or None\n" in text


def test_a_list_of_options_is_indented_as_the_docstring() -> None:
    @lists([Option("depth", 3, "depth of the tree", int, words=("auto",))])
    class Kind:
        """A kind.

        With a body.
        """
    assert Kind.__doc__ == ("A kind.\n\nWith a body.\n\nOptions\n-------\n"
                            "depth : 'auto' or int; default 3\n    depth of the tree\n")


def test_dir_lists_the_public_names() -> None:
    assert dir(rt) == sorted(rt.__all__)
    code = ("import gpgpu_rt as rt\n"
            "before = dir(rt); [getattr(rt, name) for name in before]; import gpgpu_rt.gl.shader\n"
            "print(before == dir(rt) == sorted(rt.__all__))")
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True,
                          check=True).stdout == "True\n"


def test_the_example_in_the_docstring_runs(tmp_path: Path) -> None:
    """The example code in `rt.__doc__` runs, here with a small scene and a small picture."""
    lines = re.search(r"::\n\n((?:    .*\n|\n)+)", rt.__doc__)[1]
    code = "\n".join(line[4:] for line in lines.splitlines())
    assert 8 <= len(code.strip().splitlines()) <= 12
    code = code.replace('"bunny")', '"cornell")').replace("(512, 512)", "(16, 16)")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True,
                          cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("Hits(256 rays: ") and (tmp_path / "bunny.png").exists()


def test_the_docstring_names_existing_names_and_files() -> None:
    for name in re.findall(r"\brt\.(\w+)", rt.__doc__):
        assert name in rt.__all__
    for path in re.findall(r"\b(?:examples|docs)/[\w./]*", rt.__doc__):
        assert (ROOT / path.rstrip(".")).exists(), path
