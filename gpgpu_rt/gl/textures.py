"""Textures: makes, writes and reads back the textures of tables and render targets."""
from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import moderngl
import numpy as np

from ..errors import LimitError
from .context import Gpu
from .lazy_field import Column
from .packed_record import PackedRecord
from .precision import Precision
from .record import TABLE_WIDTH_LOG2, Plane, Record, check_count

TABLE_WIDTH = 1 << TABLE_WIDTH_LOG2
# Number of records to pack at once. Their texels fill whole rows, for any record size.
RECORDS_AT_ONCE = 32 * TABLE_WIDTH


def make_texture(gpu: Gpu, size: tuple[int, int], components: int, what: str,
                 data: np.ndarray | None = None, dtype: str = "f4") -> moderngl.Texture:
    """Return a texture that programs read without filtering.

    Parameters
    ----------
    size : (width, height)
    data : (height, width, components), or None for a texture to draw into
    what : name of the texture in an error message
    dtype : f4 for floats, f2 for half floats, or u4 for integers

    Raises
    ------
    LimitError
        if the texture exceeds the renderer's limit or the free memory
    """
    gpu.check_size(*size, what)
    try:
        texture = gpu.context.texture(size, components, dtype=dtype, data=(
            None if data is None else np.ascontiguousarray(data, "<" + dtype)))
    except (moderngl.Error, MemoryError) as failure:
        raise LimitError(f"{what}: cannot make a {size[0]} x {size[1]} texture ({failure}); "
                         "trace fewer rays at a time or a smaller scene") from failure
    gpu.check_error(f"making a {size[0]} x {size[1]} texture for {what}")
    texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
    return texture


def table_textures(gpu: Gpu, record: Record | PackedRecord,
                   arrays: Mapping[str, np.ndarray | Column], precision: Precision | None = None,
                   into: Mapping[str, moderngl.Texture] | None = None
                   ) -> dict[str, moderngl.Texture]:
    """Return the textures of a table of records. A texture row has TABLE_WIDTH texels.

    Parameters
    ----------
    arrays : field name -> array
    precision : the format of geometric fields; None if the fields are rounded already
    into : an older version of this table. Textures that fit are reused; others are released

    Returns
    -------
    sampler name -> texture, for each plane (record.py) of the record

    Raises
    ------
    LimitError
        for more than 2^24 records, or if a texture exceeds the renderer's limit
    """
    count = check_table(gpu, record, arrays)
    textures = {f"{record.name}{plane.suffix}_table": _room(gpu, record.name, count, plane,
                                                            into or {})
                for plane in record.planes}
    # Pack slice by slice: a packed table is several times as large as its arrays.
    for start in range(0, max(count, 1), RECORDS_AT_ONCE):
        part = {name: values[start:start + RECORDS_AT_ONCE] for name, values in arrays.items()}
        packed = record.pack(**(precision.stored_fields(record, part) if precision else part))
        for plane, texture in zip(record.planes, textures.values()):
            texels = packed[:, plane.first:plane.first + plane.texels, :plane.components]
            _write_rows(texture, start * plane.texels // TABLE_WIDTH,
                        texels.reshape(-1, plane.components), plane.dtype)
    return textures


def largest_integer(record: Record | PackedRecord, arrays: Mapping[str, np.ndarray | Column]
                    ) -> int:
    """Return the largest absolute integer in a table's float textures."""
    fields = record.fields if isinstance(record, Record) else ()
    return max((int(np.abs(arrays[field.name][start:start + RECORDS_AT_ONCE]).max())
                for field in fields if field.is_integer and field.name in arrays
                for start in range(0, len(arrays[field.name]), RECORDS_AT_ONCE)), default=0)


def check_table(gpu: Gpu, record: Record | PackedRecord,
                arrays: Mapping[str, np.ndarray | Column]) -> int:
    """Return the number of records of a table. Raise LimitError as `table_textures` does."""
    count = len(next(iter(arrays.values())))
    check_count(record.name, count)
    for plane in record.planes:
        gpu.check_size(TABLE_WIDTH, _rows(count, plane),
                       f"a {record.name} table of {count * plane.texels} texels")
    return count


def _rows(count: int, plane: Plane) -> int:
    return max(1, -(-count * plane.texels // TABLE_WIDTH))


def _room(gpu: Gpu, name: str, count: int, plane: Plane,
          old: Mapping[str, moderngl.Texture]) -> moderngl.Texture:
    rows = _rows(count, plane)
    texture = old.get(f"{name}{plane.suffix}_table")
    if texture is not None:
        if texture.size == (TABLE_WIDTH, rows):
            return texture
        texture.release()
    texture = make_texture(gpu, (TABLE_WIDTH, rows), plane.components, name, dtype=plane.dtype)
    # Programs sample only inside the texture. llvmpipe is faster without repetition.
    texture.repeat_x = texture.repeat_y = False
    return texture


def _write_rows(texture: moderngl.Texture, row: int, texels: np.ndarray, dtype: str) -> None:
    """Write (n, components) texels from ``row`` on; zeros fill the rest of the last row."""
    rows = max(1, -(-len(texels) // TABLE_WIDTH))
    padded = np.zeros((rows * TABLE_WIDTH, texels.shape[1]), "<" + dtype)
    padded[:len(texels)] = texels
    texture.write(padded, (0, row, TABLE_WIDTH, rows))


def stream_textures(gpu: Gpu, record: Record, size: tuple[int, int]) -> list[moderngl.Texture]:
    """Return a texture for each texel of a stream's record; ``size`` is (width, height).

    On ANGLE, float textures replace half float textures, because SwiftShader draws an infinity
    into a half float texture as NaN. Programs round the values that they store, so finite
    values are the same. The textures need twice the bytes.
    """
    return [make_texture(gpu, size, 4, f"a {record.name} texture of {size[0] * size[1]:,} rays",
                         dtype="f4" if gpu.is_es else record.plane_of(texel).dtype)
            for texel in range(record.texels)]


def read_texture(texture: moderngl.Texture) -> np.ndarray:
    """Read back a float texture as (height, width, components) float32."""
    values = np.empty((texture.height, texture.width, texture.components), "<" + texture.dtype)
    texture.read_into(values)
    note_moved(texture, down=values.nbytes)
    return values.astype(np.float32, copy=False)


def read_texels(texture: moderngl.Texture, first: int, count: int) -> np.ndarray:
    """Read back texels of a table's texture, (count, components), float32 or uint32.

    Parameters
    ----------
    first : index of the first texel, counted along rows of TABLE_WIDTH texels
    """
    kind = np.uint32 if texture.dtype == "u4" else np.float32
    if texture.ctx.extra.is_es:     # ES cannot read every format through a framebuffer
        whole = np.empty((texture.height * texture.width, texture.components),
                         "<" + texture.dtype)
        texture.read_into(whole)
        note_moved(texture, down=whole.nbytes)
        return whole[first:first + count].astype(kind)
    found = np.empty((count, texture.components), kind)
    window = texture.ctx.framebuffer([texture])
    for k in range(count):      # consecutive texels may lie in two rows
        y, x = divmod(first + k, TABLE_WIDTH)
        found[k] = np.frombuffer(window.read((x, y, 1, 1), texture.components,
                                             dtype="u4" if kind is np.uint32 else "f4"), kind)
    window.release()
    note_moved(texture, down=found.nbytes)
    return found


def write_texture(texture: moderngl.Texture, values: np.ndarray,
                  viewport: tuple[int, int, int, int] | None = None) -> None:
    """Upload texels into a texture, or into its part (x, y, width, height)."""
    texture.write(values, viewport)
    note_moved(texture, up=values.nbytes)


def vector_texture(gpu: Gpu, vectors: np.ndarray, what: str) -> moderngl.Texture:
    """Return a texture of (h, w, 3) vectors; the fourth channel is 0."""
    texture = make_texture(gpu, vectors.shape[1::-1], 4, what)
    write_texture(texture, np.pad(np.asarray(vectors, np.float32), ((0, 0), (0, 0), (0, 1))))
    return texture


def note_moved(texture: moderngl.Texture, up: int = 0, down: int = 0) -> None:
    """Tell the context's observers how many bytes were uploaded and read back."""
    texture.ctx.extra.note_moved(up, down)


def texture_bytes(textures: Iterable[moderngl.Texture]) -> int:
    return sum(t.width * t.height * t.components * int(t.dtype[1]) for t in textures)


def bytes_of(*parts: Any) -> int:
    """Return the bytes of textures and of objects with a method ``bytes``.

    Parameters
    ----------
    parts : textures, objects, None, or lists, tuples and dicts of these; other parts count 0
    """
    total = 0
    for part in parts:
        if isinstance(part, moderngl.Texture):
            total += texture_bytes([part])
        elif isinstance(part, Mapping):
            total += bytes_of(*part.values())
        elif isinstance(part, list | tuple):
            total += bytes_of(*part)
        elif hasattr(part, "bytes"):
            total += part.bytes()
    return total


def release(*parts: Any) -> None:
    """Free GL objects, and other objects with a method ``release``.

    Parameters
    ----------
    parts : objects to free, None, or iterables and dicts of objects
    """
    for part in parts:
        if isinstance(part, moderngl.Framebuffer):
            part.ctx.extra.release(part)
        elif hasattr(part, "release"):
            part.release()
        elif part is not None:
            release(*(part.values() if isinstance(part, Mapping) else part))


def stream_samplers(name: str, textures: list[moderngl.Texture]) -> dict[str, moderngl.Texture]:
    """Return the textures, by sampler name, of a stream that GLSL calls ``name``."""
    return {f"{name}_texel_{k}": texture for k, texture in enumerate(textures)}
