"""How often the loops of a call's passes turn, from the renderer's own textures: before a draw is
made, fragments of it are emulated on what it will read."""
from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..gl.fragment_pass import FragmentPass
from .emulate import emulate
from .program import Work
from .sample import as_array, program_of

MOST = 4096    # fragments of a draw that are emulated; of more, as many spread evenly


@dataclass
class Turned:
    """What the draws of one program came to.

    Attributes
    ----------
    fragments : how many ran it
    emulated : of how many that is known
    work : both sides of branches, loops as often as each fragment wants, of all fragments
    fetches : texel fetches by sampler that fragments wanted, of all of them
    """

    fragments: int = 0
    emulated: int = 0
    work: Work = field(default_factory=Work)
    fetches: Counter[str] = field(default_factory=Counter)


class Turns:
    """Stands in ``gpu.watch`` during a call and fills ``found``, by name and program as a log has
    them: of passes that know what they cover; of what looks up integers nothing is known."""

    def __init__(self, most: int = MOST) -> None:
        self.most = most
        self.found: dict[tuple[str, int], Turned] = {}
        self._tables: dict[int, np.ndarray] = {}

    def note(self, one: FragmentPass, target: Any, textures: Mapping[str, Any]) -> None:
        """A pass is about to be drawn."""
        program = program_of(one.gpu.text_of(one.program))
        texels = one.covered(target.size) if program.loops else None
        if texels is None:
            return
        few = texels[::-(-len(texels) // self.most)] if len(texels) else texels
        with np.errstate(all="ignore"):
            run = emulate(program, {name: self._array(name, textures[name])
                                    for name in program.samplers}, one.uniforms, few, (1,))
        total = self.found.setdefault((one.label or one.name, id(one.program)), Turned())
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


def _times(work: Work, share: float) -> Work:
    return Work(round(share * work.vector), round(share * work.scalar), Counter(
        {name: round(share * count) for name, count in work.fetches.items()}))
