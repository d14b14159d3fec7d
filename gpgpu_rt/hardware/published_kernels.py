"""Published kernels: the instruction counts that papers published."""
from __future__ import annotations

import functools
import importlib.resources
import json
from dataclasses import dataclass


@dataclass(frozen=True)
class PublishedKernel:
    """A published count.

    Attributes
    ----------
    method, kernel : this project's names of the method and the kernel
    instructions : the paper's count
    source : paper and kernel
    read : whether the count was read in the source, not only remembered
    """

    method: str
    kernel: str
    instructions: int
    source: str
    read: bool

    @property
    def text(self) -> str:
        return f"{self.instructions} ({self.source}{'' if self.read else '; from memory'})"


@functools.cache
def published_kernels() -> tuple[PublishedKernel, ...]:
    text = (importlib.resources.files("gpgpu_rt.hardware") / "published_kernels.json").read_text()
    return tuple(PublishedKernel(**row) for row in json.loads(text)["kernels"])


def published_kernel(method: str, kernel: str) -> PublishedKernel | None:
    return next((one for one in published_kernels()
                 if (one.method, one.kernel) == (method, kernel)), None)
