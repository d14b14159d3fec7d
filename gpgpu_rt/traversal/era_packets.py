"""Packets in the era form: 2x2 rays in one loop, as Horn et al. 2007 ran them on a card with
branches.

To count instructions, a card's compiler reads the kernels one by one
(glsl/era/packet_kernel.glsl). The option ``era`` runs the whole program, `packet_loop`, for chips
that have loops.
"""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from ..errors import LimitError, OptionError
from ..gl import era_accessors
from ..gl.full_screen import FullScreenPass
from ..gl.record import Record, streams_glsl
from ..gl.target import Target
from ..rays.records import HIT, RAY_TEXELS
from ..rays.textures import RayTextures, StateBuffers
from ..statistics import Statistics
from .era import TESTS_TRIANGLES, EraDriver, EraKernel
from .era_packet_form import EraPackets
from .method import Method
from .schedules import kernel_defines

LOOP = "loop"     # the name of the whole program
RAYS = Record("packet_rays", " | ".join(
    [f"{field}_{axis}:vec4" for field in ("origin", "direction", "inverse") for axis in "xyz"]
    + ["t_min:vec4", "t_max:vec4"]))
"""The four rays of a packet. Each vector holds one number for each of the four rays."""

HITS = replace(HIT, layout="t:vec4 | u:vec4 | v:vec4 | triangle:ivec4")
"""The hits of the four rays."""

# The record has a name of its own, because the program that copies these hits to single rays also
# writes HIT.
_KEPT = replace(HITS, name="packet")


def packet_kernels(method: Method, options: Mapping[str, Any],
                   any_hit: bool = False) -> list[EraKernel]:
    """Return the kernels of a packet method in the era form, each as its own text.

    Parameters
    ----------
    method : a row with ``era_packets``
    options : the method's options, resolved
    any_hit : whether rays stop at their first hit

    Raises
    ------
    OptionError
        for options that the kernels are not written for
    """
    era = _form(method, options)
    names, found = tuple(era.changes(options)), []
    for name, layout in era.changes(options).items():
        writes_hit = name == TESTS_TRIANGLES
        changed = replace(era.state, layout=layout)
        reads = (RAYS, era.state, HITS)
        streams = era_accessors.streams_glsl(reads, (HITS,) if writes_hit else ())
        if not writes_hit:
            streams += "\n" + era_accessors.changes_glsl(changed)
        found.append(EraKernel(
            name, {**_defines(method, options, names, any_hit), "KERNEL": name,
                   "WRITES_HIT": writes_hit},
            {**_texts(method, era, "packet_kernel"), "streams": streams}, writes_hit))
    return found


def packet_loop(method: Method, options: Mapping[str, Any], any_hit: bool = False) -> EraKernel:
    """Return the whole program of a packet method; see `packet_kernels`."""
    era = _form(method, options)
    streams = "\n".join([era_accessors.far_stream_glsl(RAY_TEXELS),
                         era_accessors.streams_glsl((RAYS, era.state), (HITS,))])
    return EraKernel(LOOP, _defines(method, options, tuple(era.changes(options)), any_hit),
                     {**_texts(method, era, "packet_loop"), "streams": streams}, True)


def _form(method: Method, options: Mapping[str, Any]) -> EraPackets:
    era = method.era_packets
    if era is None:
        raise OptionError(f"method {method.name} has no packets in the era form")
    era.check(method.name, options)
    return era


def _defines(method: Method, options: Mapping[str, Any], kernels: tuple[str, ...],
             any_hit: bool) -> dict[str, object]:
    return {**method.defines(options), **kernel_defines(kernels), "ANY_HIT": any_hit}


def _texts(method: Method, era: EraPackets, name: str) -> dict[str, str]:
    return {"pass": f"file:era/{name}.glsl", "method": f"file:{era.glsl}",
            "tables": "\n".join(era_accessors.table_glsl(record)
                                for record in method.tables_for({"era": True}))}


class EraPacketTraversal(EraDriver):
    """Traces 2x2 rays per fragment, in a single pass with a loop.

    A packet at the edge of an image of odd size traces the last row or column twice.
    """

    def run(self, rays: RayTextures, buffers: StateBuffers, statistics: Statistics,
            any_hit: bool = False) -> tuple[Target, int]:
        """Trace every ray, as ``Traversal.run`` does, but without a step cap.

        Raises
        ------
        LimitError
            if the renderer ended the loop of a packet early
        """
        mine = self.generated(rays, statistics)
        for texture in mine.textures:
            texture.repeat_x = texture.repeat_y = False
        width, height = rays.size
        size = -(-width // 2), -(-height // 2)
        packets = self.keep("packets", lambda: Target(self.gpu, _KEPT, size),
                            lambda old: old.size == size)
        query = self.gpu.query()
        with query:
            program = self._loop(any_hit)
            program.set(rays_texel_size=(1 / width, 1 / height))
            self.draw(program, packets, {**self.samplers, **mine.samplers()}, statistics, LOOP)
        statistics.queries += 1
        if query.samples < size[0] * size[1]:
            raise LimitError(f"method {self.method.name} in the era form: the renderer ended the "
                             "loop of a packet early; leave era out")
        self.draw(self._hand_back(), buffers.side(0), packets.samplers(), statistics)
        return buffers.side(0), 0

    def _loop(self, any_hit: bool) -> FullScreenPass:
        def make() -> FullScreenPass:
            found = packet_loop(self.method, self.options, any_hit)
            program = FullScreenPass(self.gpu, "era/renderer.frag",
                                     {**found.defines, "DISCARDS_UNFINISHED": True},
                                     found.virtual)
            program.kernel = program.label = LOOP
            return program
        return self.program((LOOP, any_hit), make)

    def _hand_back(self) -> FullScreenPass:
        """Return the pass that copies the packets' hits to their rays."""
        return self.program("hits", lambda: FullScreenPass(
            self.gpu, "era/packet_hits.frag", {}, {"streams": streams_glsl(
                (_KEPT,), (self.method.state, HIT))}))
