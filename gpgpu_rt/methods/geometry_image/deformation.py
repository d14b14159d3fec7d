"""Deformation: a geometry image moved by a fragment program, its boxes made anew by passes."""
from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import moderngl

from ...errors import OptionError, ShaderError
from ...gl.full_screen import FullScreenPass
from ...gl.record import TABLE_WIDTH_LOG2
from ...gl.textures import make_texture, read_texture, release
from .records import POSITION
from .tree import ImageTree

if TYPE_CHECKING:
    from ...tracer import Tracer

BUILT_IN = ("wave", "twist")


class Deformation:
    """Moves what a `geometry-image` tracer traces, on the GPU: nothing is uploaded, links stay.

    Parameters
    ----------
    tracer : of the method geometry-image; positions as they are now are those at rest
    program : "wave" or "twist", a file, or GLSL that defines ``vec3 deform(vec3 rest, float
        time)``, world units. Texels at one place stay at one, so seams stay closed

    Raises
    ------
    OptionError
        a tracer of another method
    ShaderError
        a program that cannot be read or does not compile
    """

    def __init__(self, tracer: Tracer, program: str | Path) -> None:
        if not isinstance(tracer.accelerator.structure, ImageTree):
            raise OptionError(f"method {tracer.method.name} has no positions to deform; make the "
                              "tracer with method geometry-image")
        if tracer.choices.differ:
            raise OptionError("a tracer of two choices has positions that only one of them would "
                              "deform; make the tracer with method geometry-image")
        self.tracer = tracer
        layout = tracer.precision.layout(POSITION)
        suffix = layout.planes[0].suffix
        gpu, self._table = tracer.gpu, tracer._tables[POSITION.name][f"position{suffix}_table"]
        self._pass = None
        with gpu:
            self._rest = {f"rest{suffix}_table": make_texture(
                gpu, self._table.size, self._table.components, "positions at rest",
                dtype=self._table.dtype)}
            rest, = self._rest.values()
            rest.write(self._table.read())
            self._target = gpu.context.framebuffer([self._table])
            try:
                self._pass = FullScreenPass(
                    gpu, "methods/geometry_image/deform.frag",
                    {**tracer.precision.defines(), "TABLE_WIDTH_LOG2": TABLE_WIDTH_LOG2},
                    {"tables": replace(layout, name="rest").table_glsl(),
                     "deformation": _text(program)})
            except ShaderError:
                self.release()
                raise

    def to(self, time: float, read_back: bool = True) -> None:
        """Move every texel to where it is at a time, and make the boxes there.

        Parameters
        ----------
        time : what the program takes it for
        read_back : also fetch the positions, so that `tracer.scene` and the surfaces of pictures
            are those of now. Without, rays alone meet the moved triangles, and which of them have
            no area is not asked anew

        Raises
        ------
        OptionError
            within ``counting``
        Error
            after the tracer's ``release``
        """
        tracer = self.tracer
        with tracer._moving_turn():
            tracer.gpu.context.enable_only(moderngl.NOTHING)
            self._pass.set(time=float(time))
            self._pass.draw(self._target, self._rest)
            samplers = tracer._tables.samplers()
            accelerator, tree = tracer.accelerator, tracer.accelerator.structure
            accelerator.finisher.run(tracer.gpu, samplers)
            if read_back:
                at = read_texture(self._table).reshape(-1, self._table.components)
                triangles = at[:tree.texels, :3][tree.faces]
                stored = tracer._builder.stored(replace(tracer.scene, triangles=triangles))
                accelerator = tracer._builder.refit(tracer.accelerator, stored)
                tracer._tables.written[POSITION.name] = accelerator.tables[POSITION.name]
                tracer.scene = replace(tracer.scene, triangles=triangles)
                tracer._triangles = stored
                tracer._bounds = tracer.scene.bounds
            else:
                tracer._bounds = accelerator.finisher.bounds(tree.roots)
                lo, hi = (tuple(corner.tolist()) for corner in tracer._bounds)
                accelerator = replace(accelerator, uniforms={
                    **accelerator.uniforms, "scene_lo": lo, "scene_hi": hi})
            tracer.accelerator = accelerator
            if any(accelerator.tables[name] is not arrays
                   for name, arrays in tracer._tables.written.items()):
                # A triangle gained area, or lost it.
                tracer._write_tables(tracer.method.tables_for(tracer.options), accelerator)
            tracer._traversal.follow(samplers, accelerator, tracer.step_cap)
            if not read_back:
                tracer._eye_drivers.lose_triangles()
                return
            if tracer._integrator is not None:
                tracer._integrator.take(tracer._shown())
            tracer._eye_drivers.take(tracer._hit_triangles(), tracer._traversal)

    def release(self) -> None:
        """Free what the passes hold; the tracer stays where it is."""
        with self.tracer.gpu:
            release(self._pass, self._target, self._rest)

    def __enter__(self) -> Deformation:
        return self

    def __exit__(self, *exception: object) -> None:
        self.release()


def _text(program: str | Path) -> str:
    """What ``#include <deformation>`` stands for."""
    if program in BUILT_IN:
        return f"file:methods/geometry_image/{program}.glsl"
    if isinstance(program, Path) or "(" not in program:
        path = Path(program)
        if not path.is_file():
            raise ShaderError(f"no deformation {str(program)!r}: it is none of "
                              f"{', '.join(BUILT_IN)}, no file, and no GLSL with `vec3 deform`")
        return "file:" + str(path if path.is_absolute() else path.resolve())
    return program
