"""Statistics: what the last call cost."""
from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any

OF_STRUCTURE = ("method", "choice", "table_bytes", "build_seconds", "refit_seconds", "rebuilt")


@dataclass
class Statistics:
    """Cost of the last call of a tracer; times in seconds, sizes in bytes.

    Attributes
    ----------
    rays : rays given
    method : that traced, by its name in the table
    choice : of a tracer with two choices, which rays the method was taken for: "coherent" or
        "incoherent"; else ""
    passes : traversal passes, the set-up pass included
    draw_calls : draws, passes that mask or count among them
    queries : occlusion queries read back
    stopped : rays that the step cap or a full stack stopped; of a picture, shadow rays too
    kernel_passes : passes by kernel, under the ``kernels`` schedule
    live : rays that were not over, each time the schedules ``step`` and ``kernels`` counted them;
        of a picture, wave after wave
    picture_passes : of a picture, passes besides those of traversal, by name
    waves : of a picture, sets of rays that were traced
    texel_fetches : texels that those passes read, a pixel
    vertices : of a picture by paths, vertex after vertex, where they may be packed:
        ``live`` paths that came there and ``texels`` of the textures that they were in, which
        a traversal pass runs over; summed over all waves
    samples : of each pixel, by an integrator that takes samples
    noise : standard error of such a picture's pixels over their luminance, both averaged
    texture_bytes : scene tables, rays and state
    table_bytes : the scene tables by record
    build_seconds : building (or loading from the cache) and packing the accelerator, when it was
        built last
    refit_seconds : refitting and packing it, at the last update; where it was built anew, what a
        try at refitting took before
    rebuilt : whether the last update built it anew
    trace_seconds : first draw to last, finished; with ``presort``, what that took the host too
    sort_seconds : of those, what sorting rays and bringing hits back took
    upload_seconds, readback_seconds : arrays to textures, and back
    driver : what the method's own driver counts, by name
    counters : means a ray of the counters, with statistics=True
    first_hits : of a picture whose first hits were rasterised: ``drawn`` triangles, ``rivals``
        that come before what was drawn, ``retraced`` eye rays and their ``retraced_share``
    pass_log : with statistics=True, each program drawn: name, draws, fragments, bytes of streams
        read, tables sampled, bytes written; see ``gl/pass_log.py``
    uploaded_bytes, read_back_bytes : over the bus during the call, with statistics=True
    split : of a method that shares its work with the host, seconds and bytes by what they went to
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
        """Forget the last call; what building and updating cost stays."""
        self.__dict__.update(Statistics(rays=rays, **self.of_structure()).__dict__)

    def add(self, **figures: float) -> None:
        """Add to what the driver counts: its runs of a call come to one figure."""
        for name, value in figures.items():
            self.driver[name] = self.driver.get(name, 0.0) + value

    def of_structure(self) -> dict[str, Any]:
        """What is said of the structure that was traced, by name; not of a call."""
        return {name: getattr(self, name) for name in OF_STRUCTURE}
