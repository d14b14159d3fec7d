"""The fragment programs, as package data; `gpgpu_rt.shader` reads them."""
