"""Imports form no cycle between packages, and few modules are at the top level. Functions import
no module of the package, except in the files of LATE."""
from __future__ import annotations

import ast
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path

import gpgpu_rt as rt

PACKAGE = Path(rt.__file__).parent
MOST_MODULES = 12  # modules directly in gpgpu_rt, which newcomers see first
# Files whose functions may import modules of the package. The entry of the command line does this
# so that an interrupt during the import prints no traceback. Commands do this for modules that
# need optional dependencies (charts and the window). `render` does this for the model of the
# cards, so that pictures without --era do not wait for the import.
LATE = {"__main__.py", "cli/benching.py", "cli/conforming.py", "cli/tracing.py", "cli/view.py"}


def sources() -> Iterator[tuple[Path, tuple[str, ...]]]:
    """Yields each file of the package and the parts of its module name below ``gpgpu_rt``."""
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(PACKAGE).with_suffix("").parts
        yield path, parts[:-1] if parts[-1] == "__init__" else parts


def imported(path: Path, module: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], bool]]:
    """Yields each module of the package that a file imports, and whether a function contains the
    import. Imports that only type checkers see are left out."""
    def visit(node: ast.AST, late: bool) -> Iterator[tuple[tuple[str, ...], bool]]:
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.If) and "TYPE_CHECKING" in ast.dump(child.test):
                continue
            if isinstance(child, ast.ImportFrom):
                if child.level:
                    here = module if path.name == "__init__.py" else module[:-1]
                    start = here[:len(here) - child.level + 1]
                    yield (*start, *(child.module or "").split(".")), late
                elif (child.module or "").split(".")[0] == "gpgpu_rt":
                    yield tuple(child.module.split(".")[1:]), late
                continue
            yield from visit(child, late or isinstance(child, (ast.FunctionDef, ast.Lambda)))
    yield from visit(ast.parse(path.read_text()), False)


def test_no_circle_of_packages() -> None:
    """No package imports itself through other packages."""
    graph: dict[str, set[str]] = {}
    for path, module in sources():
        for target, _ in imported(path, module):
            if module and target and target[0] and target[0] != module[0]:
                graph.setdefault(module[0], set()).add(target[0])
    assert len(graph) > 15
    list(TopologicalSorter(graph).static_order())  # a CycleError names the packages of a cycle


def test_no_import_inside_a_function() -> None:
    late = {str(path.relative_to(PACKAGE)) for path, module in sources()
            for _, inside in imported(path, module) if inside}
    assert late <= LATE


def test_few_modules_at_the_top() -> None:
    assert len(list(PACKAGE.glob("*.py"))) <= MOST_MODULES
