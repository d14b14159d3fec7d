"""Textures: tables that hold a scene, and targets that passes write."""
from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import moderngl
import numpy as np

from ..errors import LimitError
from .context import Gpu
from .lazy_field import Column
from .precision import Precision
from .record import TABLE_WIDTH_LOG2, PackedRecord, Plane, Record, check_count

TABLE_WIDTH = 1 << TABLE_WIDTH_LOG2
RECORDS_AT_ONCE = 32 * TABLE_WIDTH   # whole rows, whatever texels a record has


def make_texture(gpu: Gpu, size: tuple[int, int], components: int, what: str,
                 data: np.ndarray | None = None, dtype: str = "f4") -> moderngl.Texture:
    """A texture read texel by texel, its size checked before GL is asked.

    Parameters
    ----------
    size : (width, height)
    data : (height, width, components), or None for a texture to draw into
    what : names the texture in an error
    dtype : f4, f2 for half floats, or u4 for integers

    Raises
    ------
    LimitError
        where it is larger than the renderer holds, or memory runs out.
    """
    gpu.check_size(*size, what)
    try:
        texture = gpu.context.texture(size, components, dtype=dtype, data=(
            None if data is None else np.ascontiguousarray(data, "<" + dtype)))
    except (moderngl.Error, MemoryError) as failure:
        raise LimitError(f"{what}: no {size[0]} x {size[1]} texture to be had ({failure}); "
                         "take fewer rays at a time or a smaller scene") from failure
    gpu.check_error(f"making a {size[0]} x {size[1]} texture for {what}")
    texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
    return texture


def table_textures(gpu: Gpu, record: Record | PackedRecord,
                   arrays: Mapping[str, np.ndarray | Column], precision: Precision | None = None,
                   into: Mapping[str, moderngl.Texture] | None = None
                   ) -> dict[str, moderngl.Texture]:
    """A table of records, packed as its record declares, in rows of TABLE_WIDTH texels.

    Parameters
    ----------
    arrays : by field name
    precision : what geometric fields are rounded to; None where they are already
    into : an older version of this table: its textures are written into where they fit, and
        released where they do not

    Returns
    -------
    sampler name -> texture, one a plane

    Raises
    ------
    LimitError
        past 2^24 records or past the renderer's texture size.
    """
    count = check_table(gpu, record, arrays)
    textures = {f"{record.name}{plane.suffix}_table": _room(gpu, record.name, count, plane,
                                                            into or {})
                for plane in record.planes}
    # A slice at a time: a table is several times as large as what it is made from.
    for start in range(0, max(count, 1), RECORDS_AT_ONCE):
        part = {name: values[start:start + RECORDS_AT_ONCE] for name, values in arrays.items()}
        packed = record.pack(**(precision.stored_fields(record, part) if precision else part))
        for plane, texture in zip(record.planes, textures.values()):
            texels = packed[:, plane.first:plane.first + plane.texels, :plane.components]
            _write_rows(texture, start * plane.texels // TABLE_WIDTH,
                        texels.reshape(-1, plane.components), plane.dtype)
    return textures


def check_table(gpu: Gpu, record: Record | PackedRecord,
                arrays: Mapping[str, np.ndarray | Column]) -> int:
    """How many records a table's arrays hold. LimitError as of `table_textures`."""
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
    """A texture for ``count`` records; the old one if it has the size."""
    rows = _rows(count, plane)
    texture = old.get(f"{name}{plane.suffix}_table")
    if texture is not None:
        if texture.size == (TABLE_WIDTH, rows):
            return texture
        texture.release()
    texture = make_texture(gpu, (TABLE_WIDTH, rows), plane.components, name, dtype=plane.dtype)
    # Nobody samples outside; llvmpipe then spends less on a place than where it might be repeated.
    texture.repeat_x = texture.repeat_y = False
    return texture


def _write_rows(texture: moderngl.Texture, row: int, texels: np.ndarray, dtype: str) -> None:
    """(n, components) texels from a row on; the last one is filled up with zeros."""
    rows = max(1, -(-len(texels) // TABLE_WIDTH))
    padded = np.zeros((rows * TABLE_WIDTH, texels.shape[1]), "<" + dtype)
    padded[:len(texels)] = texels
    texture.write(padded, (0, row, TABLE_WIDTH, rows))


def stream_textures(gpu: Gpu, record: Record, size: tuple[int, int]) -> list[moderngl.Texture]:
    """The textures of a stream record: one a texel, ``size`` = (width, height) rays."""
    return [make_texture(gpu, size, 4, f"a {record.name} texture of {size[0] * size[1]:,} rays",
                         dtype=record.plane_of(texel).dtype)
            for texel in range(record.texels)]


def read_texture(texture: moderngl.Texture) -> np.ndarray:
    """A float texture as (height, width, components) float32."""
    values = np.empty((texture.height, texture.width, texture.components), "<" + texture.dtype)
    texture.read_into(values)
    note_moved(texture, down=values.nbytes)
    return values.astype(np.float32, copy=False)


def write_texture(texture: moderngl.Texture, values: np.ndarray,
                  viewport: tuple[int, int, int, int] | None = None) -> None:
    """Texels from the host, into all of a texture or (x, y, width, height) of it."""
    texture.write(values, viewport)
    note_moved(texture, up=values.nbytes)


def vector_texture(gpu: Gpu, vectors: np.ndarray, what: str) -> moderngl.Texture:
    """A texture of (h, w, 3) vectors, w being 0."""
    texture = make_texture(gpu, vectors.shape[1::-1], 4, what)
    write_texture(texture, np.pad(np.asarray(vectors, np.float32), ((0, 0), (0, 0), (0, 1))))
    return texture


def note_moved(texture: moderngl.Texture, up: int = 0, down: int = 0) -> None:
    """Write bytes that went up or came down into the log of passes, where there is one."""
    texture.ctx.extra.note_moved(up, down)


def texture_bytes(textures: Iterable[moderngl.Texture]) -> int:
    """Bytes that textures take."""
    return sum(t.width * t.height * t.components * int(t.dtype[1]) for t in textures)


def bytes_of(*parts: Any) -> int:
    """Bytes of textures, and of all that has a ``bytes`` of its own; of other parts 0.

    Parameters
    ----------
    parts : these, None, or lists, tuples and dicts of them
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
    """Free GL objects, and what has a ``release`` of its own.

    Parameters
    ----------
    parts : these, None, or iterables and dicts of them
    """
    for part in parts:
        if isinstance(part, moderngl.Framebuffer):
            part.ctx.extra.release(part)
        elif hasattr(part, "release"):
            part.release()
        elif part is not None:
            release(*(part.values() if isinstance(part, Mapping) else part))


def stream_samplers(name: str, textures: list[moderngl.Texture]) -> dict[str, moderngl.Texture]:
    """Sampler name -> texture of a stream record read under ``name``."""
    return {f"{name}_texel_{k}": texture for k, texture in enumerate(textures)}
