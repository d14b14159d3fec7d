"""Loop counts: the number of loop iterations in the passes of a call.

After each draw, some of its fragments are emulated on the textures that the draw has read.
"""
from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..gl.observation import ObservedPass, Observer
from .emulate import emulate
from .program import RegionWork
from .sample import as_array, program_of

MOST = 4096    # largest number of emulated fragments per draw, spread evenly over all


@dataclass
class Turned:
    """The work of all draws of a program.

    Attributes
    ----------
    fragments : number of fragments that the draws covered
    emulated : number of emulated fragments, from which the work is extrapolated
    work : work of all fragments, with both sides of branches and with the loop iterations that
        each fragment needs
    fetches : texel fetches of all fragments by sampler, without sides of branches that were not
        executed
    """

    fragments: int = 0
    emulated: int = 0
    work: RegionWork = field(default_factory=RegionWork)
    fetches: Counter[str] = field(default_factory=Counter)


class Turns(Observer):
    """Observes a call, counts loop iterations (turns), and fills ``found``.

    The keys of ``found`` are the name and the texts of a program. Only programs with loops are
    counted, and only passes that know which fragments they cover.
    """

    def __init__(self, most: int = MOST) -> None:
        self.most = most
        self.found: dict[tuple[str, tuple[str, str]], Turned] = {}
        self._tables: dict[int, np.ndarray] = {}

    def passed(self, one: ObservedPass) -> None:
        """Emulate fragments of a pass that was just drawn."""
        program = program_of(one.texts)
        texels = one.covered() if program.loops else None
        if texels is None:
            return
        few = texels[::-(-len(texels) // self.most)] if len(texels) else texels
        with np.errstate(all="ignore"):
            run = emulate(program, {name: self._array(name, one.inputs[name])
                                    for name in program.samplers}, one.uniforms, few, (1,))
        total = self.found.setdefault((one.label, one.texts), Turned())
        share = len(texels) / max(len(few), 1)
        total.fragments += len(texels)
        total.emulated += len(few)
        total.work = total.work + _times(run.predicated(), share)
        total.fetches.update({name: round(share * count)
                              for name, count in run.fetches().items()})

    def _array(self, name: str, texture: Any) -> np.ndarray:
        if not name.endswith("_table"):
            return as_array(texture)
        if texture.glo not in self._tables:
            self._tables[texture.glo] = as_array(texture)
        return self._tables[texture.glo]


def _times(work: RegionWork, share: float) -> RegionWork:
    return RegionWork(round(share * work.vector), round(share * work.scalar), Counter(
        {name: round(share * count) for name, count in work.fetches.items()}))
