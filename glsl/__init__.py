"""The GLSL programs, as package data; `gpgpu_rt.gl.shader` reads them."""
