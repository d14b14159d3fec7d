"""Deformation: a fragment program moves a geometry image, and passes recompute its boxes."""
from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import moderngl
import numpy as np

from ...errors import OptionError, ShaderError
from ...gl.full_screen import FullScreenPass
from ...gl.record import TABLE_WIDTH_LOG2
from ...gl.textures import make_texture, read_texture, release
from ...scene.scene import Scene
from ...traversal.accelerator import Accelerator
from .records import POSITION
from .tree import ImageTree

if TYPE_CHECKING:
    from ...session.structure import Structure
    from ...tracer import Tracer

BUILT_IN = ("wave", "twist")


class Deformation:
    """Moves the surface of a `geometry-image` tracer on the GPU, without uploads.

    Parameters
    ----------
    tracer : a tracer of the method geometry-image. Its current positions become the rest positions
    program : "wave", "twist", the path of a GLSL file, or GLSL text. The GLSL defines ``vec3
        deform(vec3 rest, float time)`` in world units

    Raises
    ------
    OptionError
        for a tracer of another method, or of two methods
    ShaderError
        for a program that cannot be read or does not compile
    """

    def __init__(self, tracer: Tracer, program: str | Path) -> None:
        if not isinstance(tracer.accelerator.structure, ImageTree):
            raise OptionError(f"method {tracer.method.name} has no positions to deform; make the "
                              "tracer with method geometry-image")
        if tracer.choices.differ:
            raise OptionError("a tracer with two methods would deform the positions of only one "
                              "method; make the tracer with method geometry-image only")
        self.tracer = tracer
        layout = tracer.precision.layout(POSITION)
        suffix, gpu = layout.planes[0].suffix, tracer.gpu
        tables = tracer.session.tables
        self._table = tables[POSITION.name][f"position{suffix}_table"]
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
        """Move every texel to its position at a time, and recompute the boxes.

        Parameters
        ----------
        time : the argument ``time`` of the program
        read_back : whether to read back the positions, which `tracer.scene` and shading need.
            Without it, rays hit the moved triangles, but triangles that have lost or gained their
            area are not noticed

        Raises
        ------
        OptionError
            inside the context that ``Tracer.counting`` returns
        Error
            after the tracer's ``release``
        """
        with self.tracer.sessions.moving() as session:
            session.gpu.context.enable_only(moderngl.NOTHING)
            self._pass.set(time=float(time))
            self._pass.draw(self._target, self._rest)
            structure, accelerator = session.structure, session.accelerator
            accelerator.finisher.run(session.gpu, structure.tables.samplers())
            if read_back:
                structure.moved_by_passes(*self._read_back(structure))
            else:
                lo, hi = bounds = accelerator.finisher.bounds(accelerator.structure.roots)
                structure.moved_by_passes(replace(accelerator, uniforms={
                    **accelerator.uniforms, "scene_lo": tuple(lo.tolist()),
                    "scene_hi": tuple(hi.tolist())}), bounds)
            session.follow()
            session.follow_eye(known=read_back)

    def _read_back(self, structure: Structure) -> tuple[
            Accelerator, tuple[np.ndarray, np.ndarray], tuple[Scene, np.ndarray]]:
        """Read back positions. Return the accelerator, the bounds, and (scene, stored triangles).
        """
        tree = structure.accelerator.structure
        at = read_texture(self._table).reshape(-1, self._table.components)
        triangles = at[:tree.texels, :3][tree.faces]
        scene = replace(structure.scene, triangles=triangles)
        stored = structure.builder.stored(scene)
        accelerator = structure.builder.refit(structure.accelerator, stored)
        # The passes have already written the table of positions.
        structure.tables.written[POSITION.name] = accelerator.tables[POSITION.name]
        return accelerator, scene.bounds, (scene, stored)

    def release(self) -> None:
        """Free programs and textures. The tracer keeps its current positions."""
        with self.tracer.gpu:
            release(self._pass, self._target, self._rest)

    def __enter__(self) -> Deformation:
        return self

    def __exit__(self, *exception: object) -> None:
        self.release()


def _text(program: str | Path) -> str:
    """Return the content of ``#include <deformation>``: GLSL text, or "file:" and a path."""
    if program in BUILT_IN:
        return f"file:methods/geometry_image/{program}.glsl"
    if isinstance(program, Path) or "(" not in program:
        path = Path(program)
        if not path.is_file():
            raise ShaderError(f"no deformation {str(program)!r}; give {' or '.join(BUILT_IN)}, a "
                              "file, or GLSL that defines `vec3 deform`")
        return "file:" + str(path if path.is_absolute() else path.resolve())
    return program
