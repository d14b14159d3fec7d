"""Statistics: the cost of a tracer's last call."""
from __future__ import annotations

from dataclasses import asdict, dataclass, field, fields
from typing import Any

from . import views
from .text_format import counted

OF_STRUCTURE = ("method", "choice", "table_bytes", "build_seconds", "refit_seconds", "rebuilt")


@dataclass
class Statistics:
    """Cost of the last call of a tracer; times in seconds, sizes in bytes.

    Attributes
    ----------
    rays : Number of rays in the call.
    method : Name of the method that traced.
    choice : The kind of rays for which the tracer uses this method, "coherent" or "incoherent"; ""
        for a tracer with a single method.
    passes : Traversal passes, including the set-up pass.
    draw_calls : Draw calls, including passes that mask or count rays.
    queries : Occlusion queries read back.
    stopped : Number of rays, shadow rays included, that the step cap or a full stack stopped.
    kernel_passes : Number of passes of each kernel, under the ``kernels`` schedule.
    live : Numbers of live rays, whose search has not ended. The schedules ``step`` and ``kernels``
        append a number each time they count live rays. For a picture, the numbers of its first
        ray set come first, then the numbers of the next set, and so on.
    picture_passes : Name of a pass that traverses nothing -> number of its runs for the picture.
    waves : Number of ray sets that a picture traced.
    texel_fetches : Texels per pixel that ``picture_passes`` read.
    vertices : Counts for the first, second, ... vertex of the paths, if packing is on: live paths
        are then packed into smaller textures (``render/packed_paths.py``). ``live`` counts the
        paths that reached the vertex; ``texels`` counts the texels over which a traversal pass
        then runs. Both are sums over all ray sets.
    samples : Samples per pixel, for an integrator that samples.
    noise : Standard error of a pixel's luminance, averaged over the picture and divided by the
        average luminance, for an integrator that samples.
    texture_bytes : Bytes of all textures of the tracer.
    table_bytes : Name of a table's record (``gl/record.py``) -> bytes of the table's textures.
    build_seconds : Time of the last build: to build the accelerator or load it from the cache, and
        to pack it into tables.
    refit_seconds : Time to refit and pack the accelerator at the last update, even if a rebuild
        followed.
    rebuilt : Whether the last update rebuilt the accelerator.
    trace_seconds : Time from the first draw to the end of the last draw. ``presort`` adds the
        host's sorting of rays; `Tracer.trace_all` adds the copies between arrays and textures.
    sort_seconds : The part of ``trace_seconds`` that sorts rays and puts hits back into the
        caller's order.
    upload_seconds, readback_seconds : Time to copy arrays to textures, and textures to arrays.
    driver : Counts by name that the method's driver adds; `schedules.Traversal` adds none.
    counters : Means of the counters over all rays, with statistics=True.
    first_hits : Numbers for a picture with rasterised first hits. ``drawn``: rasterised triangles.
        ``rivals``: triangles that a ray hits before the rasterised triangle of its pixel; a
        large triangle counts once for each part of the image in which it is a rival. ``retraced``:
        eye rays that the method traced, because they miss the rasterised triangle of their pixel,
        or because their pixel has a rival. ``retraced_share``: the share of retraced rays.
    pass_log : With statistics=True, an entry per program (``gl/pass_log.py``): name, draws,
        fragments, bytes of streams read, tables sampled, bytes written.
    uploaded_bytes, read_back_bytes : With statistics=True, bytes copied to the graphics card and
        back.
    split : Purpose -> seconds or bytes, for a method that divides its work between graphics card
        and host.
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

    def __repr__(self) -> str:
        return f"Statistics({'; '.join(text for _, text in self._facts()[:4] if text)})"

    def _repr_html_(self) -> str:
        return views.table("Statistics", self._facts())

    def _facts(self) -> views.Facts:
        """Return the usual costs, and all other numbers that are not zero."""
        by = f" by {self.method}" if self.method else ""
        shown = {"rays", "method", "passes", "trace_seconds", "build_seconds", "counters"}
        rest = [(name.replace("_", " "), f"{value:,}" if isinstance(value, int) else str(value))
                for name, value in ((f.name, getattr(self, f.name)) for f in fields(self))
                if name not in shown and value and isinstance(value, (int, float, str))]
        return [("rays", counted(self.rays, "ray") + by),
                ("passes", f"{counted(self.passes, 'pass')} in {self.trace_seconds * 1e3:.0f} ms"),
                ("build", f"built in {self.build_seconds:.2f} s"),
                ("per ray", "" if not self.counters else "per ray " + ", ".join(
                    f"{value:.1f} {name.replace('_', ' ')}"
                    for name, value in self.counters.items())), *rest]

    def to_dict(self) -> dict[str, Any]:
        return asdict(self)

    def start_call(self, rays: int) -> None:
        self.__dict__.update(Statistics(rays=rays, **self.of_structure()).__dict__)

    def add(self, **figures: float) -> None:
        """Add to the counts in ``driver``, which are sums over a driver's runs in a call."""
        for name, value in figures.items():
            self.driver[name] = self.driver.get(name, 0.0) + value

    def of_structure(self) -> dict[str, Any]:
        """Return the fields that `start_call` keeps."""
        return {name: getattr(self, name) for name in OF_STRUCTURE}
