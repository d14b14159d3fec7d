"""Issued passes: lists a trace's passes, with the records that each pass reads and writes."""
from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from gpgpu_rt.gl.target import Target
from gpgpu_rt.inspect.observe import ObservedPass


@dataclass
class Issued:
    """A draw: its kernel, and the records that the kernel reads and writes.

    ``kernel`` is the name that `kernel_of` returns.
    """

    kernel: str
    reads: tuple[str, ...]
    writes: tuple[str, ...]


def kinds_of(passes: Iterable[Issued]) -> dict[str, tuple[Issued, int]]:
    """Return for each kernel its first draw and the number of its draws."""
    found: dict[str, tuple[Issued, int]] = {}
    for one in passes:
        first, count = found.get(one.kernel, (one, 0))
        found[one.kernel] = (first, count + 1)
    return found


def record_of(sampler: str) -> str:
    """Return the record that a sampler names: "state_texel_0" -> "state", "triangle_table" ->
    "triangle table".
    """
    name = sampler.rsplit("_texel_", 1)[0]
    return name.removesuffix("_table") + " table" if name.endswith("_table") else name


def kernel_of(one: ObservedPass) -> str:
    """The name of a pass in a diagram: its kernel or, without a kernel, its fragment program."""
    if one.uniforms.get("equal"):
        return "tile_pairs, again"    # this draw finds the triangle of the nearest t
    return one.kernel or one.name.split("/")[-1].removesuffix(".frag")


def issued(passes: Iterable[ObservedPass], left_out: tuple[str, ...] = ()) -> list[Issued]:
    """Return the observed passes, each with the records that it read and wrote.

    Parameters
    ----------
    left_out : names of passes that are not returned, such as passes that only count rays
    """
    kept = [one for one in passes if kernel_of(one) not in left_out]
    # A sampler that its program does not use may be bound to any texture. Leave out a read if the
    # sampler does not name the texture's record: the record that a pass wrote into the texture.
    # If no pass wrote the texture, its first sampler names its record.
    names: dict[int, str] = {}
    for one in kept:
        for record in one.target.records if isinstance(one.target, Target) else ():
            for texture in one.target.streams[record]:
                names.setdefault(texture.glo, record)
    for one in kept:
        for sampler, texture in one.inputs.items():
            names.setdefault(texture.glo, record_of(sampler))
    return [Issued(kernel_of(one),
                   tuple(dict.fromkeys(record_of(sampler) for sampler, texture in
                                       one.inputs.items()
                                       if names[texture.glo] == record_of(sampler))),
                   tuple(dict.fromkeys(names.get(texture.glo, "picture")
                                       for texture in one.outputs)))
            for one in kept]
