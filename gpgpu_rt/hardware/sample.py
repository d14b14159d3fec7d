"""Sample: the work of a method on the rays of an image, from emulated tiles of the image.

Tiles are blocks of neighbouring pixels at full resolution, spread over the image. The rays of a
tile form SIMD groups as on hardware that groups neighbouring pixels.
"""
from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..gl.observation import ObservedPass, Observer
from ..tracer import Tracer
from .compiler import check_countable, compiled
from .emulate import WIDTHS, EmulatedRun, Look, emulate, texels_along_morton, unseen
from .program import Program, parse

TRAVERSALS = ("drivers/traverse.frag", "drivers/packet.frag")
# (width, height) in pixels. The number of rays is a multiple of the SIMD widths 32 and 48, and so
# is the number of packets of 2x2 rays.
TILE = (24, 32)


def tile_pixels(size: int, tile: tuple[int, int] = TILE,
                spread: tuple[int, int] = (3, 2)) -> np.ndarray:
    """Return the pixel indices of tiles of a square image, side by side, (height, width) int.

    Parameters
    ----------
    size : side of the image in pixels
    tile : (width, height) of a tile in pixels
    spread : number of tiles across and down. The image is divided into this number of equal parts,
        and each tile lies in the middle of its part
    """
    strips = []
    for row in range(spread[1]):
        for column in range(spread[0]):
            x, y = ((size * (2 * at + 1) // (2 * count)) - side // 2
                    for at, count, side in zip((column, row), spread, tile))
            x, y = (min(max(at - at % 4, 0), size - side) for at, side in zip((x, y), tile))
            strips.append((y + np.arange(tile[1]))[:, None] * size + x + np.arange(tile[0]))
    return np.concatenate(strips, axis=1)


class FirstTraversal(Observer):
    """Records the first draw of a traversal: its program, uniforms, and textures as arrays."""

    def __init__(self) -> None:
        self.texts: tuple[str, str] | None = None
        self.uniforms: dict[str, Any] = {}
        self.samplers: dict[str, np.ndarray] = {}
        self.targets: tuple[Any, ...] = ()
        self.texel_bytes: dict[str, int] = {}
        self.written_bytes = 0    # per fragment

    def passed(self, one: ObservedPass) -> None:
        """Keep the pass, if it is the first traversal."""
        if self.texts is not None or one.name not in TRAVERSALS:
            return
        self.texts, self.targets, self.uniforms = one.texts, one.outputs, one.uniforms
        self.written_bytes = sum(map(texel_bytes, one.outputs))
        for name, texture in one.inputs.items():
            self.samplers[name] = as_array(texture)
            self.texel_bytes[name] = texel_bytes(texture)

    def results(self) -> list[np.ndarray]:
        """Return each render target, (h, w, c) float32."""
        return [as_array(texture) for texture in self.targets]


def texel_bytes(texture: Any) -> int:
    return int(texture.components) * int(texture.dtype[1])


def as_array(texture: Any) -> np.ndarray:
    """Return a texture as an array (h, w, c) of the texture's type."""
    kind = {"f4": np.float32, "f2": np.float16, "u4": np.uint32}[texture.dtype]
    return np.frombuffer(texture.read(), kind).reshape(texture.height, texture.width, -1)


def emulated(tracer: Tracer, origins: np.ndarray, directions: np.ndarray, any_hit: bool = False,
             t_max: Any = np.inf, tile: tuple[int, int] = TILE,
             widths: Sequence[int] = WIDTHS, flat: bool = False,
             look: Look = unseen) -> tuple[EmulatedRun, FirstTraversal]:
    """Trace (h, w, 3) rays of tiles side by side, and emulate the program that traced them.

    Parameters
    ----------
    tracer : the tracer
    origins, directions : (h, w, 3) float
    any_hit : whether to trace for any hit
    t_max : the ends of the rays
    tile : (width, height) of a tile in pixels
    widths : the SIMD widths to count for
    flat : whether to emulate a form of the program with a single loop, whose iterations run one
        kernel step each. The usual form has an inner loop for each kernel
    look : called at every fetch, as for `emulate`

    Returns
    -------
    (EmulatedRun, FirstTraversal)
        the emulation; and the renderer's draw, which must have the same results

    Raises
    ------
    NotCountable
        if this machine's Mesa does not print the instructions of programs
    """
    check_countable()
    watch = FirstTraversal()
    with tracer.gpu.observed(watch, whole=True):
        (tracer.occluded if any_hit else tracer.trace)(
            origins, directions, t_max=t_max, invalid="miss")
    assert watch.texts is not None
    vertex, fragment = watch.texts
    if flat:
        head, _, rest = fragment.partition("\n")     # behind #version
        fragment = f"{head}\n#define STEP_A_TURN\n{rest}"
    program = program_of((vertex, fragment))
    packet = tracer.options.get("packet", (1, 1)) if tracer.method.packet else (1, 1)
    part = tile[0] // packet[0], tile[1] // packet[1]
    inside = texels_along_morton(*part)
    tiles = origins.shape[1] // tile[0]
    texels = np.concatenate([inside + (part[0] * at, 0) for at in range(tiles)])
    with np.errstate(all="ignore"):
        return emulate(program, watch.samplers, watch.uniforms, texels, widths, look), watch


_programs: dict[tuple[str, str], Program] = {}


def programs_of(texts: Sequence[tuple[str, str]]) -> list[Program]:
    """Return the compiled programs of texts; new texts are compiled together, each only once."""
    new = [text for text in dict.fromkeys(texts) if text not in _programs]
    if new:
        check_countable()
        _programs.update(zip(new, map(parse, compiled(new))))
    return [_programs[text] for text in texts]


def program_of(texts: tuple[str, str]) -> Program:
    """Return the compiled program of a text."""
    return programs_of([texts])[0]
