"""Packets: several rays a fragment, their whole way in one pass (Horn et al. 2007)."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import moderngl

from ..gpu import Gpu
from ..methods import find_method
from ..methods.row import Accelerator, Method
from ..options import TRACER_OPTIONS, resolve_options
from ..precision import Precision
from ..ray_state import RayTextures, StateBuffer, StateBuffers
from ..statistics import Statistics
from ..texel_layout import COUNTERS, HIT, RAY_TEXELS, Record
from ..textures import make_texture, texture_bytes
from .full_screen import FullScreenPass
from .traverse import UNFINISHED, Traversal, method_defines, method_texts

# Steps a packet may take in its pass. Every step is an iteration of one loop, and no more than two
# further iterations come with it: this stays below the 65,535 at which llvmpipe ends all loops.
PACKET_STEPS = 20_000
LIVE = 1   # the phase of a ray that its packet left behind


class PacketTraversal:
    """A packet method's programs for one set of tables and options; see ``Traversal``."""

    def __init__(self, gpu: Gpu, method: Method, samplers: Mapping[str, moderngl.Texture],
                 accelerator: Accelerator, options: Mapping[str, Any], step_cap: int) -> None:
        self.gpu, self.method, self.options = gpu, method, options
        self.accelerator, self.step_cap = accelerator, step_cap
        self.samplers = dict(samplers)
        self.precision = Precision.of(options)
        self.packet: tuple[int, int] = options["packet"]
        self.rays = self.packet[0] * self.packet[1]
        self.pairs = self.rays > gpu.max_draw_buffers   # of rays a target: one each is too many
        self.targets = self.rays // 2 if self.pairs else self.rays
        self.statistics_on = bool(options["statistics"])
        self._programs: dict[object, FullScreenPass] = {}
        self._room: _PacketRoom | None = None
        self._single: Traversal | None = None
        self._single_room: tuple[RayTextures, StateBuffers] | None = None

    def follow(self, samplers: Mapping[str, moderngl.Texture], accelerator: Accelerator,
               step_cap: int) -> None:
        """Read these tables from now on: the same records, of triangles that moved."""
        if accelerator.defines != self.accelerator.defines:
            self.release()
            self._programs, self._room, self._single = {}, None, None
        self.samplers, self.accelerator, self.step_cap = dict(samplers), accelerator, step_cap
        for program in self._programs.values():
            program.set(**accelerator.uniforms)
        if self._single is not None:
            self._single.follow(samplers, accelerator, step_cap)

    def run(self, rays: RayTextures, buffers: StateBuffers, statistics: Statistics,
            any_hit: bool = False) -> tuple[StateBuffer, int]:
        """Trace every ray; the buffer with hits, and how many rays the step cap stopped."""
        self.gpu.context.enable_only(moderngl.NOTHING)
        room, now = self._room_for(buffers.size), buffers.side(0)
        for name, target in room.targets.items():
            program = self._program(name, any_hit)
            program.set(ray_texture_size=buffers.size, step_limit=min(PACKET_STEPS, self.step_cap))
            program.draw(target, {**self.samplers, **rays.samplers()})
        capped = self.step_cap <= PACKET_STEPS
        program = self._program("packet_hits", any_hit)
        program.set(unsettled_phase=UNFINISHED if capped else LIVE)
        program.draw(now.target, {**self.samplers, **rays.samplers(), **room.samplers()})
        statistics.passes += 2
        statistics.draw_calls += 1 + len(room.targets)
        left_behind = self._count(UNFINISHED if capped else LIVE, now, buffers, statistics)
        if capped or not left_behind:
            return now, left_behind
        self._trace_singly(rays, now, statistics, any_hit)
        return now, self._count(UNFINISHED, now, buffers, statistics)

    def _trace_singly(self, rays: RayTextures, now: StateBuffer, statistics: Statistics,
                      any_hit: bool) -> None:
        """Trace what packets left behind one ray a fragment, and write it into ``now``."""
        single = self._single_traversal()
        if self._single_room is None or self._single_room[0].size != rays.size:
            self._release_single_room()
            self._single_room = (
                RayTextures(self.gpu, rays.size, self.precision),
                StateBuffers(self.gpu, single.method.state, rays.size, False, self.precision))
        single_rays, single_buffers = self._single_room
        self._program("left_behind", any_hit).draw(
            single_rays.target, {**rays.samplers(), **now.samplers()})
        found, _ = single.run(single_rays, single_buffers, statistics, any_hit)
        single_samplers = {**single_rays.samplers(), **found.samplers()}
        self._program("brought_back", any_hit).draw(
            now.target, {f"single_{name}": texture for name, texture in single_samplers.items()})
        statistics.draw_calls += 2

    def _single_traversal(self) -> Traversal:
        if self._single is None:
            row = find_method(str(self.method.single))
            known = (*TRACER_OPTIONS, *row.options)
            shared = {option.name: self.options[option.name] for option in known
                      if option.name in self.options and option.accepts(self.options[option.name])}
            options = resolve_options({**shared, "schedule": "loop", "statistics": False}, known,
                                      f"method {row.name}")
            self._single = Traversal(self.gpu, row, self.samplers, self.accelerator, options,
                                     self.step_cap)
        return self._single

    def _count(self, phase: int, now: StateBuffer, buffers: StateBuffers,
               statistics: Statistics) -> int:
        program = self._program("classify", False)
        program.set(phase=phase)
        query = self.gpu.context.query(samples=True)
        with query:
            program.draw(buffers.mask, now.samplers())
        statistics.draw_calls += 1
        statistics.queries += 1
        return query.samples

    # Programs and textures ------------------------------------------------------------------

    def _program(self, name: str, any_hit: bool) -> FullScreenPass:
        if (name, any_hit) not in self._programs:
            entry = "packet" if name == "packet_counters" else name
            defines = self._defines(any_hit)
            if name == "packet":
                defines["STATISTICS"] = False
            program = FullScreenPass(self.gpu, f"passes/{entry}.frag", defines,
                                     self._virtual(name))
            program.set(**self.accelerator.uniforms)
            self._programs[name, any_hit] = program
        return self._programs[name, any_hit]

    def _defines(self, any_hit: bool) -> dict[str, object]:
        return {
            **method_defines(self.method, self.accelerator, self.options, any_hit),
            "PACKET_WIDTH": self.packet[0], "PACKET_HEIGHT": self.packet[1],
            "PACKET_TARGETS": self.targets, "PAIRS": self.pairs,
            "EACH(f)": " ".join(f"f({r});" for r in range(self.rays)),
            "EACH_TARGET(f)": " ".join(f"f({k})" for k in range(self.targets))}

    def _virtual(self, name: str) -> dict[str, str]:
        """What a pass includes: the streams that it reads and writes, tables and method."""
        layout = self.precision.layout
        written = [layout(self.method.state), layout(HIT)]
        written += [COUNTERS] if self.statistics_on else []
        reads: list[Record] = [layout(RAY_TEXELS)]
        writes: list[Record] = []
        if name in ("packet", "packet_counters"):
            reads += [r for r in written if r.name != "state"]   # their structs alone are of use
        elif name == "packet_hits":
            writes = written
        elif name == "left_behind":
            reads += written[:1]
            writes = [replace(layout(RAY_TEXELS), name="single_rays")]
        elif name == "classify":
            reads = written[:1]
        else:
            single = layout(self._single_traversal().method.state)
            reads = [replace(layout(RAY_TEXELS), name="single_rays"),
                     replace(single, name="single_state"),
                     replace(layout(HIT), name="single_hit")]
            writes = written[:2]
        texts, target = [record.stream_glsl(writes=False) for record in reads], 0
        for record in writes:
            texts.append(record.stream_glsl(True, target))
            target += record.texels
        return {**method_texts(self.method, self.options), "streams": "\n".join(texts)}

    def _room_for(self, size: tuple[int, int]) -> _PacketRoom:
        packets = (-(-size[0] // self.packet[0]), -(-size[1] // self.packet[1]))
        if self._room is None or self._room.size != packets:
            if self._room is not None:
                self._room.release()
            self._room = _PacketRoom(self.gpu, packets, self.targets, self.pairs,
                                     self.statistics_on)
        return self._room

    def bytes(self) -> int:
        """Bytes of the packets' own targets."""
        return self._room.bytes() if self._room is not None else 0

    def _release_single_room(self) -> None:
        if self._single_room is not None:
            for part in self._single_room:
                part.release()
            self._single_room = None

    def release(self) -> None:
        for program in self._programs.values():
            program.release()
        self._release_single_room()
        for part in (self._room, self._single):
            if part is not None:
                part.release()


class _PacketRoom:
    """What packets draw into: one or two rays' hits a target; their counters in a pass apart."""

    def __init__(self, gpu: Gpu, size: tuple[int, int], targets: int, pairs: bool,
                 statistics: bool) -> None:
        self.gpu, self.size = gpu, size
        what = f"{size[0] * size[1]} packets"
        self.hits = [make_texture(gpu, size, 4, what, dtype="u4" if pairs else "f4")
                     for _ in range(targets)]
        self.counters = [make_texture(gpu, size, 4, what)] if statistics else []
        self.targets = {"packet": gpu.context.framebuffer(self.hits)}
        if statistics:
            self.targets["packet_counters"] = gpu.context.framebuffer(self.counters)

    def samplers(self) -> dict[str, moderngl.Texture]:
        return {**{f"packet_texels_{k}": texture for k, texture in enumerate(self.hits)},
                **{"packet_counters": texture for texture in self.counters}}

    def bytes(self) -> int:
        return texture_bytes((*self.hits, *self.counters))

    def release(self) -> None:
        for target in self.targets.values():
            self.gpu.release(target)
        for texture in (*self.hits, *self.counters):
            texture.release()
