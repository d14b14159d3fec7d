"""Float textures: tables that hold a scene, and targets that passes write."""
from __future__ import annotations

from collections.abc import Mapping

import moderngl
import numpy as np

from .errors import LimitError
from .gpu import Gpu
from .texel_layout import TABLE_WIDTH_LOG2, Record

TABLE_WIDTH = 1 << TABLE_WIDTH_LOG2


def float_texture(gpu: Gpu, size: tuple[int, int], components: int, what: str,
                  data: np.ndarray | None = None) -> moderngl.Texture:
    """A float32 texture read texel by texel, its size checked before GL is asked.

    Parameters
    ----------
    size : (width, height)
    data : (height, width, components) float32, or None for a texture to draw into
    what : names the texture in an error

    Raises
    ------
    LimitError
        where it is larger than the renderer holds, or memory runs out.
    """
    gpu.check_size(*size, what)
    try:
        texture = gpu.context.texture(size, components, dtype="f4",
                                      data=None if data is None else np.ascontiguousarray(data))
    except (moderngl.Error, MemoryError) as failure:
        raise LimitError(f"{what}: no {size[0]} x {size[1]} texture to be had ({failure}); "
                         "take fewer rays at a time or a smaller scene") from failure
    gpu.check_error(f"making a {size[0]} x {size[1]} texture for {what}")
    texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
    return texture


def table_texture(gpu: Gpu, record: Record, arrays: Mapping[str, np.ndarray]) -> moderngl.Texture:
    """A table of records, packed as ``texel_layout`` declares, in rows of TABLE_WIDTH texels.

    Raises
    ------
    LimitError
        past 2^24 records or past the renderer's texture size.
    """
    packed = record.pack(**arrays).reshape(-1, record.components)
    rows = max(1, -(-len(packed) // TABLE_WIDTH))
    gpu.check_size(TABLE_WIDTH, rows, f"a table of {len(packed) // record.texels} {record.name}s")
    padded = np.zeros((rows * TABLE_WIDTH, record.components), np.float32)
    padded[:len(packed)] = packed
    return float_texture(gpu, (TABLE_WIDTH, rows), record.components, record.name, padded)


def stream_textures(gpu: Gpu, record: Record, size: tuple[int, int]) -> list[moderngl.Texture]:
    """The textures of a stream record: one a texel, ``size`` = (width, height) rays."""
    return [float_texture(gpu, size, 4, f"{record.name} of {size[0] * size[1]} rays")
            for _ in range(record.texels)]


def texture_bytes(textures: list[moderngl.Texture]) -> int:
    """Bytes that textures take, four a channel."""
    return sum(t.width * t.height * t.components * 4 for t in textures)
