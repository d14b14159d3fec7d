"""``gpgpu-rt render --era``: predict the time that a card of 2002-2006 would have taken."""
from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from ..errors import OptionError
from ..hardware.era_time import EraTime, era_timed
from ..tracer import Tracer

CardTime = tuple[dict[str, Any], list[str]]


@contextmanager
def watched_for_card(tracer: Tracer) -> Iterator[Callable[[], CardTime]]:
    """Yield a function to call after the block. The function predicts the time of the block's
    traversal on the card of the option ``era``. It returns a dict for JSON, and lines of text.

    The dict has ``card``, ``form`` (of the card's program), ``rays`` (their kinds), ``seconds``
    and ``parts`` (seconds by name), or only ``no_prediction`` (the reason). If an index in one
    channel could not have addressed all texels on the card, ``limit`` says so.
    """
    with era_timed(tracer) as seen:
        yield lambda: _with_lines(_time_on_card(seen), tracer)


def _time_on_card(seen: EraTime) -> dict[str, Any]:
    try:
        card, time = seen.on_card()
    except OptionError as reason:
        return {"no_prediction": str(reason)}
    limits = {"limit": one.says for one in seen.refusals[:1]}
    return {"card": card.name, "form": seen.form, "rays": list(seen.rays),
            "seconds": time.seconds, **limits,
            "parts": {name: seconds for name, seconds in time.parts.items() if seconds}}


def _with_lines(found: dict[str, Any], tracer: Tracer) -> CardTime:
    lines = []
    if found.get("parts"):
        shares = sorted(found["parts"].items(), key=lambda part: -part[1])
        if "limit" in found:
            lines.append(
                f"the {found['card']} could not have run these kernels. They store an index in "
                f"one channel, and this scene {found['limit']}. The next line is the time of "
                "kernels that address the texels by two coordinates, as in the papers")
        lines.append(
            f"the {found['card']} would have taken about {found['seconds'] * 1e3:,.0f} ms "
            f"for the traversal's passes, without shading (form: {found['form']}; rays: "
            f"{', '.join(found['rays'])}; "
            + ", ".join(f"{name} {part / found['seconds']:.0%}" for name, part in shares)
            + "); `python -m gpgpu_rt.figures --only era_machine` says how well such predictions "
            "fit")
    else:
        lines.append(f"no prediction: {found['no_prediction']}")
    if "interval" in tracer.options and tracer.options["arithmetic"] == "fp24":
        lines.append("in fp24 a kd-tree loses hits on triangles that are perpendicular to an "
                     "axis; docs/era.md says how many")
    return found, lines
