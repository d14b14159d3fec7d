"""Packets in the era form: 2x2 rays in one loop, as Horn et al. 2007 ran them on a card with
branches.

A card's compiler counts the kernels one by one (glsl/era/packet_kernel.glsl). `packet_loop` is the
whole program. The era's schedule is a kernel a pass, so the option ``era`` does not run packets.
"""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from ..errors import OptionError
from ..gl import era_accessors
from ..gl.record import Record
from ..rays.records import HIT, RAY_TEXELS
from .era import TESTS_TRIANGLES, EraKernel
from .method import EraPackets, Method
from .schedules import kernel_defines

LOOP = "loop"     # the name of the whole program
RAYS = Record("packet_rays", " | ".join(
    [f"{field}_{axis}:vec4" for field in ("origin", "direction", "inverse") for axis in "xyz"]
    + ["t_min:vec4", "t_max:vec4"]))
"""The four rays of a packet. Each vector has a number of each ray."""

HITS = replace(HIT, layout="t:vec4 | u:vec4 | v:vec4 | triangle:ivec4")
"""The hits of the four rays."""


def packet_kernels(method: Method, options: Mapping[str, Any],
                   any_hit: bool = False) -> list[EraKernel]:
    """Return the kernels of a packet method in a loop.

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
    """Return the whole program of a packet method. Parameters and errors as `packet_kernels`."""
    era = _form(method, options)
    streams = "\n".join([era_accessors.far_stream_glsl(RAY_TEXELS),
                         era_accessors.streams_glsl((RAYS, era.state), (HITS,))])
    return EraKernel(LOOP, _defines(method, options, tuple(era.changes(options)), any_hit),
                     {**_texts(method, era, "packet_loop"), "streams": streams}, True)


def _form(method: Method, options: Mapping[str, Any]) -> EraPackets:
    era = method.era_packets
    if era is None:
        raise OptionError(f"method {method.name} has no packets in the era form")
    for name, values in era.fits.items():
        if options[name] not in values:
            raise OptionError(f"method {method.name} with {name}={options[name]} has no era form: "
                              f"its kernels are written for {name}={values[0]}")
    return era


def _defines(method: Method, options: Mapping[str, Any], kernels: tuple[str, ...],
             any_hit: bool) -> dict[str, object]:
    return {**method.defines(options), **kernel_defines(kernels), "ANY_HIT": any_hit}


def _texts(method: Method, era: EraPackets, name: str) -> dict[str, str]:
    return {"pass": f"file:era/{name}.glsl", "method": f"file:{era.glsl}",
            "tables": "\n".join(era_accessors.table_glsl(record)
                                for record in method.tables_for({"era": True}))}
