"""Statistics: the cost of a tracer's last call."""
from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any

OF_STRUCTURE = ("method", "choice", "table_bytes", "build_seconds", "refit_seconds", "rebuilt")


@dataclass
class Statistics:
    """Cost of the last call of a tracer; times in seconds, sizes in bytes.

    Attributes
    ----------
    rays : number of rays in the call
    method : name of the method that traced
    choice : "coherent" or "incoherent" where the tracer has a method for each: the rays for which
        this method was chosen; else ""
    passes : traversal passes, including the set-up pass
    draw_calls : draw calls, including passes that mask or count rays
    queries : occlusion queries read back
    stopped : rays that the step cap or a full stack stopped; a picture counts its shadow rays too
    kernel_passes : passes by kernel, under the ``kernels`` schedule
    live : live rays, each time the schedules ``step`` and ``kernels`` counted them; a picture
        lists the counts of its waves one after another
    picture_passes : passes of a picture other than traversal passes, by name
    waves : number of ray sets that a picture traced
    texel_fetches : texels per pixel that ``picture_passes`` read
    vertices : for a picture by paths that may be packed, an entry per path vertex: the ``live``
        paths that reached the vertex and the ``texels`` of the textures that held them, which a
        traversal pass covers; summed over all waves
    samples : samples per pixel, for an integrator that samples
    noise : standard error of the pixels of such a picture over their luminance, both averaged
    texture_bytes : scene tables, rays and state
    table_bytes : the scene tables by record
    build_seconds : Time to build the accelerator, or to load it from the cache, and to pack it,
        at the last build.
    refit_seconds : Time to refit and pack the accelerator, at the last update. After a rebuild,
        the time of the attempt to refit that preceded the rebuild.
    rebuilt : Whether the last update rebuilt the accelerator.
    trace_seconds : Time from the first draw to the end of the last draw. With ``presort``, also
        the time that the host sorts.
    sort_seconds : The part of ``trace_seconds`` that sorts rays and restores the order of hits.
    upload_seconds, readback_seconds : Time to copy arrays to textures, and textures to arrays.
    driver : Counts of the method's own driver, by name.
    counters : Means of the counters over all rays, with statistics=True.
    first_hits : For a picture with rasterised first hits. The keys are ``drawn`` triangles,
        ``rivals`` that come before the drawn triangle of a pixel, ``retraced`` eye rays and their
        ``retraced_share``.
    pass_log : With statistics=True, an entry per program: name, draws, fragments, bytes of streams
        read, tables sampled, bytes written; see ``gl/pass_log.py``.
    uploaded_bytes, read_back_bytes : Bytes over the bus during the call, with statistics=True.
    split : Seconds and bytes by purpose, for a method that shares its work with the host.
    """

    rays: int = 0
    method: str = ""
    choice: str = ""
    passes: int = 0
    draw_calls: int = 0
    queries: int = 0
    stopped: int = 0
    kernel_passes: dict[str, int] = field(default_factory=dict)
    live: list[int] = field(default_factory=list)
    picture_passes: dict[str, int] = field(default_factory=dict)
    waves: int = 0
    texel_fetches: int = 0
    vertices: list[dict[str, int]] = field(default_factory=list)
    samples: int = 0
    noise: float | None = None
    texture_bytes: int = 0
    table_bytes: dict[str, int] = field(default_factory=dict)
    build_seconds: float = 0.0
    refit_seconds: float = 0.0
    rebuilt: bool = False
    trace_seconds: float = 0.0
    sort_seconds: float = 0.0
    upload_seconds: float = 0.0
    readback_seconds: float = 0.0
    driver: dict[str, float] = field(default_factory=dict)
    counters: dict[str, float] = field(default_factory=dict)
    first_hits: dict[str, float] = field(default_factory=dict)
    pass_log: list[dict[str, Any]] = field(default_factory=list)
    uploaded_bytes: int = 0
    read_back_bytes: int = 0
    split: dict[str, float] = field(default_factory=dict)

    def to_dict(self) -> dict[str, Any]:
        return asdict(self)

    def start_call(self, rays: int) -> None:
        """Reset the figures of the last call, and keep the costs of building and updating."""
        self.__dict__.update(Statistics(rays=rays, **self.of_structure()).__dict__)

    def add(self, **figures: float) -> None:
        """Add to the driver's counts, which sum over all its runs in a call."""
        for name, value in figures.items():
            self.driver[name] = self.driver.get(name, 0.0) + value

    def of_structure(self) -> dict[str, Any]:
        """Return the figures of the traced structure, by name; they do not belong to a call."""
        return {name: getattr(self, name) for name in OF_STRUCTURE}
