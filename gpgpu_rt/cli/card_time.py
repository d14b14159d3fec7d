"""``gpgpu-rt render --era``: predict the time that a card of 2002-2006 would have taken."""
from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from ..errors import OptionError
from ..hardware.era_time import EraTime, era_timed
from ..hardware.machine_model import CardTime
from ..hardware.program_forms import MEANINGS
from ..options import spell
from ..tracer import Tracer

Told = tuple[dict[str, Any], list[str]]


@contextmanager
def watched_for_card(tracer: Tracer) -> Iterator[Callable[[tuple[int, int]], Told]]:
    """Yield a function to call after the ``with`` block.

    The function predicts how long the card of the option ``era`` would have taken for the rays
    that were traced in the block. Its argument is the (width, height) of the picture in pixels.
    Its results are a dict for JSON (``on_card`` in docs/reference/json.md), and lines of text.
    """
    with era_timed(tracer) as seen:
        yield lambda size: _told(seen, size)


def _told(seen: EraTime, size: tuple[int, int]) -> Told:
    try:
        times = {form: seen.on_card(form) for form in seen.forms}
    except OptionError as reason:
        return {"no_prediction": str(reason)}, [f"no prediction: {reason}", *_losses(seen.tracer)]
    card, ran = seen.card.name, times[seen.ran]
    lines = [f"the {card} would have taken about {time.seconds * 1e3:,.0f} ms for the rays of "
             f"{spell(size)} pixels, without shading (form {form}: {MEANINGS[form]}"
             f"{_standing(form, seen)}; rays: {', '.join(seen.rays)}; {time.shares})"
             for form, time in times.items()]
    found = {"card": card, "ran": seen.ran, "form": MEANINGS[seen.ran], "rays": list(seen.rays),
             "size": list(size), **_time(ran),
             "forms": {form: _time(time) for form, time in times.items()}}
    return found, lines + _losses(seen.tracer)


def _time(time: CardTime) -> dict[str, Any]:
    return {"seconds": time.seconds, "parts": time.spent}


def _standing(form: str, seen: EraTime) -> str:
    """Return ", as here" for the form in which the kernels ran. For the card's usual form, also
    name the command that compares times in this form with the papers' times."""
    here = ", as here" if form == seen.ran else ""
    return here + ("; `python -m gpgpu_rt.figures --only era_machine` compares times in this form "
                   "with the papers' times" if form == seen.forms[0] else "")


def _losses(tracer: Tracer) -> list[str]:
    if "interval" not in tracer.options or tracer.options["arithmetic"] != "fp24":
        return []
    return ["in fp24 a kd-tree loses hits on triangles that are perpendicular to an axis; "
            "docs/era.md says how many"]
