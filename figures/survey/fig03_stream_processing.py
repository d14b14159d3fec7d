"""Figure 3: the graphics pipeline as a stream processor, drawn from the passes of a real trace.

The drawn streams and tables come from records. The records of rays and hits are the same for all
methods; a method's row of the method table names all other records. Inputs and outputs come from
linked programs, and the list of passes comes from an observed trace.
"""
from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.patches import FancyBboxPatch, Rectangle

import gpgpu_rt as rt
from gpgpu_rt.gl.record import Record
from gpgpu_rt.inspect.observe import ObservedPass, observe_states
from gpgpu_rt.methods import find_method
from gpgpu_rt.rays.records import HIT, RAY_TEXELS

from ..diagrams.plan import INK, PALE, SPLITS, TRIANGLE, VISITED
from ..diagrams.small_world import MAX_DEPTH, world
from ..framework.cell import Cell
from ..framework.output import markdown_table, plt, save_chart, write_csv, write_text

METHOD, SHOWN, SIDE = "kd-restart", "down", 16     # SHOWN: the drawn kernel; SIDE: rays per side
HEADS = ("pass", "kernel", "reads streams", "gathers from tables", "writes", "rays, pass by pass")
COLOURS = {"init": PALE, "down": SPLITS[0], "intersect": TRIANGLE}


@dataclass(frozen=True)
class KernelPass:
    """A pass as it was issued.

    Attributes
    ----------
    kernel : "init", or one of the method's kernels.
    samples : textures that the pass's program samples.
    targets : render targets that the pass draws into, named after their streams.
    source, target : the buffers that the pass read and wrote, "A" or "B"; ``source`` is "" if
        the pass read no buffer.
    rays : number of rays on which the kernel ran.
    """

    kernel: str
    samples: tuple[str, ...]
    targets: tuple[str, ...]
    source: str
    target: str
    rays: int


def streams(method: str) -> dict[str, str]:
    """The streams that a method's passes read: texture -> the contents of its channels."""
    return {**texels_of(RAY_TEXELS), **written(method)}


def written(method: str) -> dict[str, str]:
    """The streams that a method's passes write: texture -> the contents of its channels."""
    return {**texels_of(find_method(method).state), **texels_of(HIT)}


def tables(method: str) -> dict[str, str]:
    """The tables that a method's passes gather from: texture -> the fields of its record."""
    return {f"{record.name}_table": ", ".join(field.name for field in record.fields)
            for record in find_method(method).tables if isinstance(record, Record)}


def texels_of(record: Record) -> dict[str, str]:
    """The textures of a record's stream: texture -> the fields in its channels."""
    return {f"{record.name}_texel_{texel}": ", ".join(
        field.name + (f".{'xyzw'[:field.width]}" if field.width > 1 else "")
        for field in record.fields if field.texel == texel) for texel in range(record.texels)}


def rays() -> tuple[np.ndarray, np.ndarray]:
    """Origins and directions, (SIDE^2, 3) each.

    The rays start where the ray of `world` starts, in all directions of the world's plane.
    """
    angle = np.linspace(0, 2 * np.pi, SIDE * SIDE, endpoint=False)
    return (np.tile(world().origin, (len(angle), 1)),
            np.column_stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)]))


@lru_cache(maxsize=None)
def passes(method: str = METHOD) -> tuple[KernelPass, ...]:
    """The passes of one trace of ``rays()`` under the schedule `kernels`."""
    found: list[KernelPass] = []
    with rt.Tracer(world().scene, method, schedule="kernels", mask_interval=2,
                   max_depth=MAX_DEPTH) as tracer:
        sides: dict[int, str] = {}     # texture -> the buffer that it belongs to
        stepped = np.zeros(SIDE * SIDE, np.int32)

        def look(one: ObservedPass) -> None:
            side = sides.setdefault(one.outputs[0].glo, "B" if sides else "A")
            sides.update({texture.glo: side for texture in one.outputs})
            source = next((sides[texture.glo] for texture in one.inputs.values()
                           if texture.glo in sides), "")
            steps = one.target.fields(tracer.method.state.name)["steps"]
            # Early depth rejects the fragments of rays that wait for another kernel, so their
            # texels keep old values. The kernel ran where the number of steps has grown.
            ran = steps > stepped if source else np.ones(len(steps), bool)
            stepped[ran] = steps[ran]
            found.append(KernelPass(one.kernel, tuple(sorted(one.inputs)),
                                    tuple(one.target.samplers()), source, side, int(ran.sum())))
        with observe_states(tracer, look):
            tracer.trace(*rays(), shape=(SIDE, SIDE))
    return tuple(found)


def cells(full: bool) -> list[Cell]:
    return []


def draw(data: Path, out: Path, full: bool) -> None:
    row, every = find_method(METHOD), passes()
    write_csv(out / "fig03.csv", ("pass", "kernel", "from", "to", "rays"),
              [[at, one.kernel, one.source, one.target, one.rays]
               for at, one in enumerate(every, 1)])
    kinds = {one.kernel: one for one in reversed(every)}
    lines = [[str(1 + [p.kernel for p in every].index(kernel)), kernel,
              ", ".join(name for name in kinds[kernel].samples if name in streams(METHOD)),
              ", ".join(name for name in kinds[kernel].samples if name in tables(METHOD)) or "-",
              ", ".join(kinds[kernel].targets),
              " + ".join(str(p.rays) for p in every if p.kernel == kernel)]
             for kernel in ("init", *row.kernels)]
    write_text(out / "fig03.md", f"# Figure 3: a pass as stream processing\n\nUnder the schedule "
               f"`kernels`, `{METHOD}` traces {SIDE * SIDE} rays in {len(every)} passes. Each "
               "term of the graphics pipeline has a counterpart in stream computation: a pass is "
               "a kernel, a texel is a stream element, and a full-screen triangle issues the "
               "kernel. A table is read at computed positions (a gather). A stream is read only "
               "at the fragment's own position. Textures are listed only if the linked program "
               "samples them.\n\n"
               + markdown_table(HEADS, lines))
    figure, (axis, strip) = plt.subplots(2, 1, figsize=(12, 8.6), height_ratios=(5.2, 1))
    draw_pass(axis, kinds[SHOWN], row)
    draw_list(strip, every)
    figure.tight_layout(rect=(0, 0.04, 1, 1))
    save_chart(figure, out / "fig03.png", f"{METHOD}, kernel {SHOWN}; in parentheses: the "
               "terms of stream computation. The textures are those of the method's records. Pale "
               "textures are not used by this kernel. Each chosen kernel runs in two passes; "
               "sometimes no ray waits for the second.",
               "A diagram: textures of rays and states flow into a kernel, which writes the "
               "next states. Bars below show the number of rays in each pass of a trace")


def draw_pass(axis: Any, shown: KernelPass, row: Any) -> None:
    axis.set(xlim=(0, 100), ylim=(0, 72))
    axis.axis("off")
    heading(axis, 15, 70, "textures, one texel a ray\n(input streams)")
    ends = stack_boxes(axis, 1, 61, streams(METHOD), shown.samples)
    heading(axis, 85, 70, "render targets, one texel a ray\n(output streams)")
    starts = stack_boxes(axis, 71, 61, written(METHOD), shown.targets)
    heading(axis, 62, 26, "textures read at computed\npositions (gather)")
    gathered = tables(METHOD)
    order = sorted(gathered, key=lambda name: name not in shown.samples)   # sampled textures first
    gathers = stack_boxes(axis, 36, 16, {name: gathered[name] for name in order}, shown.samples)
    stages = (("full-screen triangle", "(issue the kernel)", 61),
              ("rasteriser", "(one fragment per stream element)", 52.5),
              ("early depth", f"(mask: only rays that wait for {shown.kernel})", 44),
              ("fragment program", f"(kernel {shown.kernel})\ndrivers/traverse.frag with "
               f"{row.glsl}", 33.5))
    for at, (name, meaning, y) in enumerate(stages):
        last = at == len(stages) - 1
        box(axis, 36, y - 2 * last, 28, 8 if last else 6, name, meaning,
            VISITED if last else "white")
        if not last:
            arrow(axis, (50, y), (50, y - 2.5 if at < 2 else 39.5))
    middle = 35.5
    for name, y in ends.items():
        if name in shown.samples:
            arrow(axis, (29, y), (36, middle))
    for name, y in starts.items():
        if name in shown.targets:
            arrow(axis, (64, middle), (71, y))
    top = max(gathers.values()) + 2.4
    arrow(axis, (50, top), (50, 31.5))
    axis.text(85, min(starts.values()) - 6, "the next pass reads what this pass wrote:\nstate and "
              "hit alternate between\ntwo buffers, A and B", ha="center", va="top",
              fontsize=8.5, color=SPLITS[1])


def draw_list(axis: Any, every: tuple[KernelPass, ...]) -> None:
    """Draw a bar per pass, in order. The colour shows the kernel; the height shows the rays."""
    most = max(one.rays for one in every)
    for at, one in enumerate(every):
        axis.add_patch(Rectangle((at + 0.06, 0), 0.88, one.rays / most,
                                 facecolor=COLOURS.get(one.kernel, SPLITS[1])))
        axis.text(at + 0.5, one.rays / most + 0.03, str(one.rays), fontsize=6, ha="center",
                  color="#777777")
        axis.text(at + 0.5, -0.06, f"{one.source}{'→' if one.source else ''}{one.target}",
                  fontsize=5.5, ha="center", va="top", color="#777777")
    for at, kernel in enumerate(dict.fromkeys(one.kernel for one in every)):
        axis.text(len(every) * (0.55 + 0.14 * at), 1.0, f"■ {kernel}", fontsize=9,
                  color=COLOURS.get(kernel, SPLITS[1]))
    axis.set(xlim=(0, len(every)), ylim=(-0.25, 1.2), xticks=[], yticks=[], ylabel="rays")
    axis.set_title(f"all {len(every)} passes of one trace, with source and target buffers",
                   fontsize=9)
    axis.spines[["top", "left", "right", "bottom"]].set_visible(False)


def heading(axis: Any, x: float, y: float, text: str) -> None:
    axis.text(x, y, text, ha="center", va="center", fontsize=9.5, color=INK)


def stack_boxes(axis: Any, x: float, y: float, textures: dict[str, str],
                used: tuple[str, ...]) -> dict[str, float]:
    """Draw boxes for textures, one below another. Return the y of each box's middle."""
    middles = {}
    for at, (name, holds) in enumerate(textures.items()):
        bottom = y - 6.6 * at
        box(axis, x, bottom, 28, 5.4, name, holds, "white", INK if name in used else PALE)
        middles[name] = bottom + 2.7
    return middles


def box(axis: Any, x: float, y: float, width: float, height: float, title: str, text: str,
        colour: str = "white", ink: str = INK) -> None:
    axis.add_patch(FancyBboxPatch((x, y), width, height, facecolor=colour, edgecolor=ink,
                                  boxstyle="round,pad=0,rounding_size=0.8", linewidth=1.2))
    lines = text.count("\n")
    axis.text(x + width / 2, y + height - 1.9, title, ha="center", va="center", fontsize=9,
              color=ink)
    axis.text(x + width / 2, y + (height - 1.9) / 2 - 0.4 + 0.2 * lines, text, ha="center",
              va="center", fontsize=7.5, color=ink)


def arrow(axis: Any, start: tuple[float, float], end: tuple[float, float]) -> None:
    axis.annotate("", xy=end, xytext=start, arrowprops={
        "arrowstyle": "-|>", "color": INK, "lw": 1.2, "shrinkA": 0, "shrinkB": 0})
