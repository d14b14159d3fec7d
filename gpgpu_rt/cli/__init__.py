"""The command line: ``gpgpu-rt`` and ``python -m gpgpu_rt``."""
from .main import main

__all__ = ["main"]
