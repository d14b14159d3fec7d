"""A pass: one program run on every texel of a target."""
from __future__ import annotations

from collections.abc import Mapping

import moderngl

from ..errors import Error
from ..gpu import Gpu
from ..shader import compile_program


GL_SAMPLER_2D = 0x8B5E


class FullScreenPass:
    """A fragment program from ``glsl/passes/`` and the triangle that covers its target."""

    def __init__(self, gpu: Gpu, fragment: str, defines: Mapping[str, object] | None = None,
                 virtual: Mapping[str, str] | None = None) -> None:
        self.gpu = gpu
        self.name = fragment
        self.program = compile_program(gpu, fragment, defines, virtual)
        self.triangle = gpu.context.vertex_array(self.program, [])
        self._samplers = [name for name in self.program
                          if getattr(self.program[name], "gl_type", None) == GL_SAMPLER_2D]
        for unit, name in enumerate(self._samplers):
            self.program[name].value = unit

    def set(self, **uniforms: object) -> None:
        """Set uniforms by name; one that this variant compiled away is passed over."""
        for name, value in uniforms.items():
            if name in self.program:
                self.program[name].value = value

    def draw(self, target: moderngl.Framebuffer, textures: Mapping[str, moderngl.Texture],
             depth: float = 0.0) -> None:
        """Run on every texel of ``target`` that the depth test lets through.

        Parameters
        ----------
        textures : sampler name -> texture; more than the program samples may be given
        depth : window depth in [0, 1] to write and test with
        """
        attached = {texture.glo for texture in target.color_attachments}
        for unit, name in enumerate(self._samplers):
            texture = textures[name]
            if texture.glo in attached:   # GL would not say so: results are undefined
                raise Error(f"{self.name} samples {name} while drawing into it")
            texture.use(unit)
        if "depth" in self.program:
            self.program["depth"].value = 2.0 * depth - 1.0
        target.use()
        self.triangle.render(moderngl.TRIANGLES, vertices=3)

    def release(self) -> None:
        self.triangle.release()
