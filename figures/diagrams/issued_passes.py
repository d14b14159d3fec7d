"""Issued passes: the passes of a trace, with the records that each program read and wrote."""
from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import gpgpu_rt as rt
from gpgpu_rt.traversal.schedules import ProgramKey


@dataclass
class Issued:
    """A draw: its kernel (or its program, if it has no kernel), and the records it uses."""

    kernel: str
    reads: tuple[str, ...]
    targets: tuple[int, ...]
    writes: tuple[str, ...] = ()


@dataclass
class IssuedPasses:
    """The draws of a trace, in their order."""

    issued: list[Issued] = field(default_factory=list)
    names: dict[int, str] = field(default_factory=dict)

    def kinds(self) -> dict[str, tuple[Issued, int]]:
        """Kernel -> its first draw, and the number of its draws."""
        found: dict[str, tuple[Issued, int]] = {}
        for one in self.issued:
            first, count = found.get(one.kernel, (one, 0))
            found[one.kernel] = (first, count + 1)
        return found


def record_of(sampler: str) -> str:
    """The record that a texture holds: state_texel_0 is state, triangle_table triangle table."""
    name = sampler.rsplit("_texel_", 1)[0]
    return name.removesuffix("_table") + " table" if name.endswith("_table") else name


@contextmanager
def logged(tracer: rt.Tracer, left_out: tuple[str, ...] = ()) -> Iterator[IssuedPasses]:
    """Within the context, log every draw of the tracer.

    Parameters
    ----------
    left_out : programs that are not logged, such as those that only count
    """
    log = IssuedPasses()

    def kernel_of(drawn: Any) -> str:
        if drawn.uniforms.get("equal"):
            return "tile_pairs, again"    # the second pass, for the triangles at the smallest t
        for key, one in getattr(tracer.session.driver, "programs", {}).items():
            if one is drawn and isinstance(key, ProgramKey):
                return ("init", *tracer.method.kernels)[key.kernel]
        return str(drawn.name).split("/")[-1].removesuffix(".frag")

    class Watch:
        """Logs each draw."""

        def note(self, drawn: Any, target: Any, textures: Any) -> None:
            name = kernel_of(drawn)
            if name in left_out:
                return
            attached = tuple(texture.glo for texture in target.color_attachments)
            # A program may need a texture bound that it does not read in this draw. The texture
            # then has a second name. A draw does not read what it writes.
            for sampler, texture in textures.items():
                log.names.setdefault(texture.glo, record_of(sampler))
            reads = dict.fromkeys(record_of(sampler) for sampler in drawn.samplers
                                  if log.names[textures[sampler].glo] == record_of(sampler))
            log.issued.append(Issued(name, tuple(reads), attached))
    try:
        with tracer.gpu.watched(Watch()):
            yield log
    finally:
        for one in log.issued:
            one.writes = tuple(dict.fromkeys(log.names.get(glo, "picture") for glo in one.targets))
