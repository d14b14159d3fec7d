"""Settings of path tracing that its GPU and float64 forms share."""
from __future__ import annotations

from dataclasses import dataclass

from ..errors import OptionError

MOST_SURVIVE = 0.95     # of a path that weighs its all, so that none goes on for ever
SAMPLERS = ("sobol", "random")


@dataclass(frozen=True)
class PathSettings:
    """How long paths get, and which random numbers they draw.

    Attributes
    ----------
    bounces : how often a path may turn at most; 0 shows what emits alone
    roulette : the vertex from which paths end by chance, those that weigh little the sooner
        (Russian roulette: what goes on weighs more by as much)
    seed : another one gives another picture of the same scene, with noise of its own
    sampler : "sobol", numbers that are spread evenly over the samples of a pixel, or "random" ones
    """

    bounces: int = 64
    roulette: int = 4
    seed: int = 0
    sampler: str = "sobol"

    def __post_init__(self) -> None:
        for name, least, most in (("bounces", 0, 4094), ("roulette", 1, 4095), ("seed", 0, 65535)):
            value = getattr(self, name)
            if not isinstance(value, int) or not least <= value <= most:
                raise OptionError(f"{name} is {value!r}; give a whole number from {least} to "
                                  f"{most}")
        if self.sampler not in SAMPLERS:
            raise OptionError(f"sampler is {self.sampler!r}; give {' or '.join(SAMPLERS)}")
