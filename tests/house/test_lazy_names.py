"""Importing the package imports no library. A public name loads its module at first use."""
from __future__ import annotations

import ast
import importlib
import inspect
import pickle
import pkgutil
import subprocess
import sys

import pytest

import gpgpu_rt as rt


def fresh(code: str) -> str:
    """Returns the output of a new Python process that runs the code."""
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True,
                          check=True).stdout


def test_importing_the_package_imports_no_library() -> None:
    assert fresh("import gpgpu_rt, sys; print('numpy' in sys.modules)") == "False\n"


def test_type_checkers_see_the_names_that_there_are() -> None:
    block = next(node for node in ast.parse(inspect.getsource(rt)).body
                 if isinstance(node, ast.If))
    seen = {name.name: node.module for node in block.body if isinstance(node, ast.ImportFrom)
            and node.level for name in node.names}
    assert seen == {**rt._HOMES, "reference": None}
    assert sorted(seen) == sorted(rt.__all__) and {*rt.__all__} <= {*dir(rt)}


@pytest.mark.parametrize("first", ["", "import gpgpu_rt.methods", "from gpgpu_rt import scene",
                                   "from gpgpu_rt.methods import find_method"])
def test_methods_is_the_function_whatever_was_imported(first: str) -> None:
    assert fresh(f"{first}\nimport gpgpu_rt as rt\nprint(len(rt.methods()) > 10)\n"
                 "from gpgpu_rt import methods\nprint(methods is rt.methods)") == "True\nTrue\n"


def test_names_and_modules_are_there_when_asked_for() -> None:
    assert fresh("import gpgpu_rt as rt\nprint(rt.errors.Error is rt.Error, rt.inspect.__name__)\n"
                 "from gpgpu_rt import *\nprint(Tracer is rt.Tracer)"
                 ) == "True gpgpu_rt.inspect\nTrue\n"
    assert pickle.loads(pickle.dumps(rt.Camera)) is rt.Camera
    for name in ("Tracr", "no_module", "__wrapped__"):
        with pytest.raises(AttributeError, match=name):
            getattr(rt, name)


@pytest.mark.full
@pytest.mark.once
@pytest.mark.parametrize("package", ["gpgpu_rt." + one.name for one in pkgutil.iter_modules(
    rt.__path__) if one.name not in ("viewer", "__main__")])
def test_every_module_can_be_the_first(package: str) -> None:
    """Every module outside the viewer can be imported first, without help from an earlier import
    of another module of the package."""
    code = ("import importlib, pkgutil, sys, moderngl, trimesh\n"
            f"found = importlib.import_module('{package}')\n"
            "for one in pkgutil.walk_packages(getattr(found, '__path__', []), '{}.'):\n"
            "    for name in [n for n in sys.modules if n.partition('.')[0] == 'gpgpu_rt']:\n"
            "        del sys.modules[name]\n"
            "    if not one.name.endswith('__main__'): importlib.import_module(one.name)\n")
    fresh(code.replace("'{}.'", f"'{package}.'"))
    assert importlib.import_module(package)
