"""Lists the layouts of records in texels, from the declarations."""
from __future__ import annotations

import importlib
from collections.abc import Iterator
from pathlib import Path

import gpgpu_rt
from gpgpu_rt.gl.record import Record
from gpgpu_rt.inspect.record_meaning import texts_below

from .markdown import code, table

_PACKAGE = Path(gpgpu_rt.__file__).parent


def records_text() -> str:
    seen: set[int] = set()
    sections = []
    for path, records in _modules():
        new = {name: one for name, one in records.items() if id(one) not in seen}
        seen.update(map(id, new.values()))
        if new:
            texts = texts_below(_PACKAGE.parent / path)
            sections.append(f"\n## {path}\n" + "".join(
                f"\n### {name}\n\n{texts[name]}\n\nIn GLSL {code(one.name)}:\n\n{_texels(one)}"
                for name, one in new.items()))
    return "".join(sections)


def _modules() -> Iterator[tuple[str, dict[str, Record]]]:
    """Yields each module that declares records, and the records by name."""
    paths = [path for path in _PACKAGE.rglob("*.py")
             if path.name in ("records.py", "triangle_table.py")]
    # Shared records come first, so that each record is listed only in the module that declares it:
    # modules below methods/ import some of the shared records.
    for path in sorted(paths, key=lambda path: ("methods" in path.parts, path)):
        parts = path.relative_to(_PACKAGE).with_suffix("").parts
        module = importlib.import_module(".".join(("gpgpu_rt", *parts)))
        yield (str(path.relative_to(_PACKAGE.parent)),
               {name: one for name, one in vars(module).items() if isinstance(one, Record)})


def _texels(record: Record) -> str:
    rows = [[str(texel), "", "", "", ""] for texel in range(record.texels)]
    for field in record.fields:
        for k in range(field.width):
            rows[field.texel][1 + field.channel + k] = code(
                field.name + (f".{'xyzw'[k]}" if field.width > 1 else "")
                + (" (int)" if field.is_integer else ""))
    return table(("texel", "x", "y", "z", "w"), rows)
