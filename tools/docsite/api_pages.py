"""Writes a page for each public name of the package; Sphinx adds signature and docstring."""
from __future__ import annotations

import importlib
import inspect
from collections.abc import Iterator
from typing import Any

from .markdown import code, plain, table

# Documented module -> heading of the module's table. The table has the names of __all__ or,
# without __all__, the public names that the module defines.
MODULES = {
    "gpgpu_rt": "gpgpu_rt, usually imported as rt",
    "gpgpu_rt.reference": "gpgpu_rt.reference: exact answers",
    "gpgpu_rt.trimesh_ray": "gpgpu_rt.trimesh_ray: a replacement for trimesh's ray engines",
    "gpgpu_rt.inspect.observe": "gpgpu_rt.inspect.observe: passes as they are drawn",
    "gpgpu_rt.inspect.time_travel": "gpgpu_rt.inspect.time_travel: the states after each pass",
    "gpgpu_rt.inspect.heat": "gpgpu_rt.inspect.heat: the cost of each ray",
    "gpgpu_rt.workers": "gpgpu_rt.workers: several processes or machines"}


def _names(module: str) -> dict[str, Any]:
    """Returns a module's public functions and classes with docstrings, by name."""
    home = importlib.import_module(module)
    names = getattr(home, "__all__", None) or [
        name for name, one in vars(home).items() if not name.startswith("_")
        and getattr(one, "__module__", None) == module]
    found = {name: getattr(home, name) for name in sorted(names, key=str.lower)}
    return {name: one for name, one in found.items()
            if (inspect.isclass(one) or inspect.isroutine(one)) and one.__doc__}


def api_table() -> str:
    """Returns a table of names for each module, and a list of the names' pages."""
    text, pages = "", []
    for module, title in MODULES.items():
        names = _names(module)
        pages += [_page(module, name) for name in names]
        text += f"\n## {title}\n\n" + table(("name", "what it is"), [
            (f"[{code(name)}]({_page(module, name)}.md)", plain(_first_sentence(one)))
            for name, one in names.items()])
    return text + "\n```{toctree}\n:hidden:\n\n" + "\n".join(pages) + "\n```\n"


def api_pages() -> Iterator[tuple[str, str]]:
    """Yields the name and the text of each public name's page."""
    for module in MODULES:
        for name, one in _names(module).items():
            kind = "autoclass" if inspect.isclass(one) else "autofunction"
            yield (f"reference/{_page(module, name)}.md", f"# {name}\n\n```{{eval-rst}}\n"
                   f".. {kind}:: {module}.{name}\n```\n")


def _page(module: str, name: str) -> str:
    return f"api/{'.'.join([*module.split('.')[1:], name])}"


def _first_sentence(one: Any) -> str:
    text = (inspect.getdoc(one) or "").partition("\n\n")[0]
    return text.partition(". ")[0].rstrip(".") + "."
