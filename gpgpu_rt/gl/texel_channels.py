"""Texel channels: writes columns of values into texels in fast ways.

numpy copies arrays with a short last axis element by element. The functions here copy whole
columns or whole texels.
"""
from __future__ import annotations

import numpy as np

_TEXEL = np.dtype(np.complex128)    # an item of 16 bytes, the size of four float32


def whole_texels(texels: np.ndarray) -> np.ndarray:
    """Return (..., 4) float32 texels as (...) items of 16 bytes, without a copy."""
    return texels.view(_TEXEL)[..., 0]


def write_channels(texels: np.ndarray, channel: int, values: np.ndarray) -> None:
    """Write values into adjacent channels of texels.

    A vec3 in the first three channels may also change the fourth channel, so write the fourth
    channel later.

    Parameters
    ----------
    texels : (n, 4) float32 with any strides
    channel : the first channel that is written
    values : (n, k) numbers
    """
    if (values.shape[1] == 3 and values.dtype == np.float32 and values.flags.c_contiguous
            and len(values) > 1 and channel == 0 and texels.strides[1] == texels.itemsize):
        # Copy 16 bytes from each vec3: the fourth float is the next vec3's first component.
        after = np.ndarray(len(values) - 1, _TEXEL, values, strides=(values.strides[0],))
        whole_texels(texels)[:-1] = after
        texels[-1, :3] = values[-1]
        return
    for k in range(values.shape[1]):
        texels[:, channel + k] = values[:, k]
