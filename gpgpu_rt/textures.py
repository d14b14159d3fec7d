"""Textures: tables that hold a scene, and targets that passes write."""
from __future__ import annotations

from collections.abc import Iterable, Mapping

import moderngl
import numpy as np

from .errors import LimitError
from .gpu import Gpu
from .texel_layout import TABLE_WIDTH_LOG2, PackedRecord, Record

TABLE_WIDTH = 1 << TABLE_WIDTH_LOG2


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
                   arrays: Mapping[str, np.ndarray]) -> dict[str, moderngl.Texture]:
    """A table of records, packed as ``texel_layout`` declares, in rows of TABLE_WIDTH texels.

    Parameters
    ----------
    arrays : by field name, already rounded to the record's storage

    Returns
    -------
    sampler name -> texture, one a plane

    Raises
    ------
    LimitError
        past 2^24 records or past the renderer's texture size.
    """
    packed = record.pack(**arrays)
    if isinstance(record, PackedRecord):
        texels = packed.reshape(-1, min(4, record.channels))
        return {f"{record.name}_table": _in_rows(gpu, record.name, texels, "u4")}
    textures = {}
    for plane in record.planes:
        texels = packed[:, plane.first:plane.first + plane.texels, :plane.components]
        textures[f"{record.name}{plane.suffix}_table"] = _in_rows(
            gpu, record.name, texels.reshape(-1, plane.components), plane.dtype)
    return textures


def _in_rows(gpu: Gpu, name: str, texels: np.ndarray, dtype: str) -> moderngl.Texture:
    """(n, components) texels in a texture of as many rows as they need."""
    rows = max(1, -(-len(texels) // TABLE_WIDTH))
    gpu.check_size(TABLE_WIDTH, rows, f"a {name} table of {len(texels)} texels")
    padded = np.zeros((rows * TABLE_WIDTH, texels.shape[1]), texels.dtype)
    padded[:len(texels)] = texels
    return make_texture(gpu, (TABLE_WIDTH, rows), texels.shape[1], name, padded, dtype)


def stream_textures(gpu: Gpu, record: Record, size: tuple[int, int]) -> list[moderngl.Texture]:
    """The textures of a stream record: one a texel, ``size`` = (width, height) rays."""
    return [make_texture(gpu, size, 4, f"a {record.name} texture of {size[0] * size[1]:,} rays",
                         dtype=record.plane_of(texel).dtype)
            for texel in range(record.texels)]


def read_texture(texture: moderngl.Texture) -> np.ndarray:
    """A float texture as (height, width, components) float32."""
    values = np.empty((texture.height, texture.width, texture.components), "<" + texture.dtype)
    texture.read_into(values)
    return values.astype(np.float32, copy=False)


def texture_bytes(textures: Iterable[moderngl.Texture]) -> int:
    """Bytes that textures take."""
    return sum(t.width * t.height * t.components * int(t.dtype[1]) for t in textures)
