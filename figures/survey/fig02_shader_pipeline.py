"""Figure 2: the stages of the shader pipeline, with the data of two draws.

A stage's inputs and outputs are read from linked programs, queries and bound textures. The figure
shows two draws:

* a full-screen pass of `kd-restart`: each ray is a fragment;
* a pass of the `ray-engine`: each quad covers the rays that test one triangle.
"""
from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import moderngl

import gpgpu_rt as rt
from gpgpu_rt.inspect.observe import ObservedPass

from ..diagrams.plan import INK, PALE, SPLITS, TRIANGLE, VISITED
from ..diagrams.small_world import MAX_DEPTH, world
from ..framework.cell import Cell
from ..framework.output import markdown_table, plt, save_chart, write_csv, write_text
from .fig03_stream_processing import SIDE, arrow, box, heading, rays

SHOWN = (("kd-restart", "drivers/traverse.frag", {"max_depth": MAX_DEPTH, "schedule": "loop"}),
         ("ray-engine", "methods/ray_engine/quads.frag",
          {"resolution": (4, 4, 1), "batch": 128, "queue": 4}))
STAGES = ("vertex buffer", "vertex program", "rasteriser", "fragment program", "frame buffer")
HEADS = ("method", *STAGES, "textures")
_SAMPLER = re.compile(r"uniform\s+[iu]?sampler2D\s+(\w+)")


@dataclass(frozen=True)
class PipelineDraw:
    """A draw's data in the stages of the pipeline.

    Attributes
    ----------
    method : the method that issued the draw.
    vertex, fragment : the draw's programs.
    attributes : name of each vertex attribute -> number of its components.
    primitives : number of triangles that the rasteriser received.
    fragments : number of fragments that the framebuffer received.
    textures : the sampled textures, name -> (width, height, channels, type).
    by_fragments : the textures that only the fragment program samples.
    targets : the render targets, (width, height, channels, type) each.
    """

    method: str
    vertex: str
    fragment: str
    attributes: dict[str, int]
    primitives: int
    fragments: int
    textures: dict[str, tuple[int, int, int, str]]
    by_fragments: tuple[str, ...]
    targets: tuple[tuple[int, int, int, str], ...]


def stages_of(method: str, one: ObservedPass) -> PipelineDraw:
    members = {key: one.program[key] for key in one.program}
    attributes = {key: member.dimension * member.array_length for key, member in members.items()
                  if isinstance(member, moderngl.Attribute) and not key.startswith("gl_")}
    assert one.primitives is not None and one.fragments is not None
    return PipelineDraw(
        method, one.vertex, one.name, attributes, one.primitives, one.fragments,
        {key: _shape(texture) for key, texture in one.inputs.items()},
        tuple(key for key in one.inputs if key not in set(_SAMPLER.findall(one.texts[0]))),
        tuple(map(_shape, one.outputs)))


def _shape(texture: moderngl.Texture) -> tuple[int, int, int, str]:
    return texture.width, texture.height, texture.components, texture.dtype


@lru_cache(maxsize=1)
def shown() -> tuple[PipelineDraw, ...]:
    """Trace Figure 3's rays, and return the largest draw of each program in SHOWN."""
    found = []
    for method, fragment, options in SHOWN:
        with (rt.Tracer(world().scene, method, **options) as tracer,
              tracer.observe(fragments=True) as passes):
            tracer.trace(*rays(), shape=(SIDE, SIDE))
            drawn = [stages_of(method, one) for one in passes if one.name == fragment]
        found.append(max(drawn, key=lambda one: one.primitives))
    return tuple(found)


def words(one: PipelineDraw) -> dict[str, str]:
    """Return stage -> the text that describes the stage for this draw."""
    inputs = ", ".join(f"{name} ({count})" for name, count in one.attributes.items())
    width, height = one.targets[0][:2]
    return {"vertex buffer": f"attributes (components each): {inputs or 'none'}",
            "vertex program": one.vertex,
            "rasteriser": f"{one.primitives} triangle{'s' * (one.primitives != 1)} in "
                          f"{width}x{height} pixels",
            "fragment program": one.fragment,
            "frame buffer": f"{one.fragments} fragments into {len(one.targets)} "
                            f"target{'s' * (len(one.targets) != 1)} of {width}x{height}, "
                            f"{sum(shape[2] for shape in one.targets)} floats each",
            "textures": ", ".join(
                f"{name} {w}x{h}x{channels} {kind}"
                + ("" if name in one.by_fragments else " (by the vertex program)")
                for name, (w, h, channels, kind) in one.textures.items())}


def cells(full: bool) -> list[Cell]:
    return []


def draw(data: Path, out: Path, full: bool) -> None:
    lines = [[one.method, *words(one).values()] for one in shown()]
    write_csv(out / "fig02.csv", HEADS, lines)
    write_text(out / "fig02.md", (
        "# Figure 2: the shader pipeline, as passes of this program go through it\n\n"
        f"The table shows two draws over {SIDE * SIDE} rays. Vertex and fragment programs are "
        "programmable; all other stages are fixed. A full-screen pass uses the first half "
        "of the pipeline only to issue one fragment per ray. The Ray Engine sends triangles "
        "through the pipeline: for each queue of rays that may hit a triangle, the triangle "
        "becomes a quad over this queue, and blending keeps the nearest hit. Queries around the "
        "draw count triangles and fragments. "
        "Attributes and textures are listed only if the linked programs use them. A render "
        "target becomes a texture of a later pass.\n\n"
        + markdown_table(HEADS, lines)))
    figure, axes = plt.subplots(len(lines), 1, figsize=(13, 8.6))
    for axis, one in zip(axes, shown()):
        draw_pipeline(axis, one)
    figure.tight_layout(rect=(0, 0.03, 1, 0.98))
    save_chart(figure, out / "fig02.png", "Blue: programmable stages. Textures: width x height x "
               "channels. Green textures are tables, read at computed positions; black textures "
               "are streams, read at the fragment's own position.",
               "A diagram: each pass of this program as a row of boxes, from the vertices "
               "through the rasteriser and the fragment program to the render target")


def draw_pipeline(axis: Any, one: PipelineDraw) -> None:
    axis.set(xlim=(0, 110), ylim=(0, 42))
    axis.axis("off")
    heading(axis, 55, 40, f"{one.method}: {one.vertex}, {one.fragment}")
    said = words(one)
    for at, stage in enumerate(STAGES):
        x = 1 + 22 * at
        box(axis, x, 22, 18, 13, stage, _wrapped(said[stage]),
            VISITED if "program" in stage else "white")
        if at:
            arrow(axis, (x - 4, 28.5), (x, 28.5))
    names = list(one.textures)
    across = min(5, max(1, len(names)))
    for at, name in enumerate(names):
        w, h, channels, kind = one.textures[name]
        box(axis, 1 + 22 * (at % across), 8 - 7.5 * (at // across), 19, 6.4, name,
            f"{w}x{h}x{channels} {kind}", "white", TRIANGLE if name.endswith("_table") else INK)
        user = "fragment" if name in one.by_fragments else "vertex"
        axis.annotate("", xy=(76 if user == "fragment" else 32, 22), xytext=(
            10.5 + 22 * (at % across), 14.4), arrowprops={
                "arrowstyle": "-|>", "color": PALE, "lw": 1.2})
    axis.annotate("", xy=(102, 15.5), xytext=(102, 22), arrowprops={
        "arrowstyle": "-|>", "color": SPLITS[1], "lw": 1.4})
    axis.text(103, 18.5, "read by a\nlater pass", fontsize=7.5, color=SPLITS[1], va="center")
    axis.text(1, 16.4, "textures", fontsize=8.5, color=INK)


def _wrapped(text: str, width: int = 27) -> str:
    """Break ``text`` at blanks into lines of at most ``width`` letters."""
    lines = [""]
    for word in text.split(" "):
        if lines[-1] and len(lines[-1]) + 1 + len(word) > width:
            lines.append(word)
        else:
            lines[-1] = f"{lines[-1]} {word}".strip()
    return "\n".join(lines)
