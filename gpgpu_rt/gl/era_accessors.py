"""Accessors of records in the era dialect: GLSL 1.20 without integers (glsl/era/card.frag).

A single multiply-add computes a texel's texture coordinates x and y from a pointer.

A pointer is usually an index i, a float. As x = (i + 1/2) / TABLE_WIDTH, the integer part of x is
the texel's row. A table repeats along x (wrap mode), so a program can sample at x without removing
this integer part.

With ``Record.texel_pointers``, a pointer is a column and a row. The renderer then rounds
coordinates to the number format of the card.
"""
from __future__ import annotations

from collections.abc import Iterable

from ..errors import LimitError
from .record import FLOATS, Field, Record
from .textures import TABLE_WIDTH

# With an index and more rows, rounding to float32 could move a coordinate into the next row.
MOST_ROWS = 1000


def table_glsl(record: Record) -> str:
    """Return a table's accessors, such as ``kd_node_split(i)`` for a pointer ``i``. The table has
    a texture per texel of a record (`Record.apart`)."""
    name, pointer = record.name, "vec2" if record.texel_pointers else "float"
    lines = [f"uniform sampler2D {sampler};" for sampler in table_samplers(record)]
    lines += [f"uniform vec2 {name}_step;    // texture coordinates for each unit of a pointer",
              f"uniform vec2 {name}_start;   // texture coordinates of element 0"]
    for field, sampler in zip(record.fields, _sampler_of_fields(record)):
        at = f"i * {name}_step + {name}_start"
        texel = f"texel_at({sampler}, {f'R({at})' if record.texel_pointers else at})"
        lines.append(f"{_type(field)} {name}_{field.name}({pointer} i) "
                     f"{{ return {texel}.{field.swizzle}; }}")
    return "\n".join(lines)


def table_samplers(record: Record) -> list[str]:
    return [f"{record.name}{plane.suffix}_table" for plane in record.planes]


def table_places(record: Record, rows: int) -> dict[str, tuple[float, float]]:
    """Return the uniforms of `table_glsl` for textures with this number of rows.

    Raises
    ------
    LimitError
        for a table with indices whose coordinates float32 cannot distinguish
    """
    if record.texel_pointers:
        column, row = 1 / TABLE_WIDTH, 1 / rows
        return {f"{record.name}_step": (column, row),
                f"{record.name}_start": (column / 2, row / 2)}
    if rows > MOST_ROWS:
        raise LimitError(f"a {record.name} table of {rows} rows: the era form addresses at most "
                         f"{MOST_ROWS} rows; use a smaller scene")
    column, row = 1 / TABLE_WIDTH, 1 / (TABLE_WIDTH * rows)
    return {f"{record.name}_step": (column, row), f"{record.name}_start": (column / 2, row / 2)}


def _sampler_of_fields(record: Record) -> list[str]:
    return [f"{record.name}{record.plane_of(field.texel).suffix}_table"
            for field in record.fields]


def streams_glsl(reads: Iterable[Record], writes: Iterable[Record]) -> str:
    """Return accessors of the streams that a fragment reads and writes at its own texel. Written
    streams use the render targets in order."""
    texts, target, read, written = [], 0, tuple(reads), tuple(writes)
    for record in dict.fromkeys((*read, *written)):
        texts += [f"#ifndef {constant}\n#define {constant} {float(value)}\n#endif"
                  for constant, value in record.constants]
        texts.append(_struct_glsl(record))
        if record in read:
            texts.append(_load_glsl(record))
        if record in written:
            texts.append(_store_glsl(record, target))
            target += record.texels
    return "\n".join(texts)


def changes_glsl(changed: Record) -> str:
    """Return a store function for some fields of a stream whose struct is already declared.

    Parameters
    ----------
    changed : a record with the stream's name and only the fields to store
    """
    return _store_glsl(changed, 0)


def far_stream_glsl(record: Record) -> str:
    """Return an accessor of a stream at any texel: ``name_load(texel)``."""
    size = f"{record.name}_texel_size"
    return "\n".join([_struct_glsl(record),
                      f"uniform vec2 {size};    // of a texel, in texture coordinates",
                      _load_glsl(record, "vec2 texel", f"texel_at(%s, texel * {size})")])


def _struct_glsl(record: Record) -> str:
    fields = " ".join(f"{_type(field)} {field.name};" for field in record.fields)
    return f"struct {record.name.capitalize()} {{ {fields} }};"


def _load_glsl(record: Record, parameter: str = "", fetch: str = "texel_of(%s)") -> str:
    """Return the load function; ``fetch`` is GLSL that reads the texture %s."""
    samplers = [f"{record.name}_texel_{k}" for k in range(record.texels)]
    struct = record.name.capitalize()
    read = ", ".join(f"texel_{field.texel}.{field.swizzle}" for field in record.fields)
    return "\n".join([*(f"uniform sampler2D {sampler};" for sampler in samplers),
                      f"{struct} {record.name}_load({parameter}) {{",
                      *(f"    vec4 texel_{k} = {fetch % sampler};"
                        for k, sampler in enumerate(samplers)),
                      f"    return {struct}({read});", "}"])


def _store_glsl(record: Record, first: int) -> str:
    lines = [f"void {record.name}_store({record.name.capitalize()} record) {{"]
    for k in range(record.texels):
        fields = [field for field in record.fields if field.texel == k]
        free = ["0.0"] * (4 - sum(field.width for field in fields))
        values = ", ".join([*(f"record.{field.name}" for field in fields), *free])
        lines.append(f"    TARGET({first + k}) = vec4({values});")
    return "\n".join([*lines, "}"])


def _type(field: Field) -> str:
    return FLOATS.get(field.glsl_type, field.glsl_type)
