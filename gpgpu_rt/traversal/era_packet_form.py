"""Era packet form: describes a method's packets in the era form (see era.py)."""
from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from ..errors import OptionError
from ..gl.record import Record
from ..options import ERA_LOOPS, Option, spell


@dataclass(frozen=True)
class EraPackets:
    """The era form of a packet method (traversal/era_packets.py).

    Attributes
    ----------
    glsl : file under ``glsl/`` with the kernels
    state : the record of a packet's state, which a loop keeps in registers
    changes : (options) -> {kernel: the fields of ``state`` that the kernel computes}; the kernels
        are in the order of their phases
    fits : option -> the values for which the kernels are written
    driver : name of the driver in ``traversal/``, as in `Method.drivers`
    """

    glsl: str
    state: Record
    changes: Callable[[Mapping[str, Any]], Mapping[str, str]]
    fits: Mapping[str, tuple[Any, ...]]
    driver: str = "era_packets.EraPacketTraversal"

    def implied(self, options: Iterable[Option]) -> dict[str, Any]:
        """Return the options that the era form implies: the schedule, and a value for each of
        ``options`` whose default does not fit."""
        return {"schedule": "loop", **{
            option.name: self.fits[option.name][0] for option in options
            if option.default not in self.fits.get(option.name, (option.default,))}}

    def check(self, method: str, options: Mapping[str, Any]) -> None:
        """Raise OptionError if the kernels of ``method`` are not written for the options, or if
        the chip has no loops."""
        for name, values in self.fits.items():
            if name in options and options[name] not in values:
                raise OptionError(
                    f"method {method} with {name}={spell(options[name])} has no era form: its "
                    f"kernels are written for {name}={spell(values[0])}")
        if options.get("era") not in (None, *ERA_LOOPS):
            raise OptionError(f"method {method} has no era form on era={options['era']}: its "
                              "program is a loop, and this card has no loops; give "
                              + " or ".join(f"era={chip}" for chip in ERA_LOOPS))
