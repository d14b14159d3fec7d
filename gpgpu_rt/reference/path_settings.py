"""Path settings: the settings that the path tracers on the GPU and in float64 share."""
from __future__ import annotations

from dataclasses import dataclass

from ..errors import OptionError

MOST_SURVIVE = 0.95     # largest survival probability in Russian roulette, so that all paths end
SAMPLERS = ("sobol", "random")


@dataclass(frozen=True)
class PathSettings:
    """The settings of path lengths and of random numbers.

    Attributes
    ----------
    bounces : largest number of bounces of a path; with 0, only emitting surfaces and surroundings
        are visible
    roulette : first vertex at which Russian roulette may end a path. The smaller the path's
        weight, the likelier is the end. The weight of surviving paths grows to compensate
    seed : the seed of the random numbers
    sampler : "sobol" for numbers evenly distributed over a pixel's samples, or "random"

    Raises
    ------
    OptionError
        a value is out of range
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
