"""The value that a control shows for an option: the user's value, or the automatic value."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ..options import AUTOMATIC, Option, spell
from ..tracer import Tracer


@dataclass(frozen=True)
class Shown:
    """An option's value as a control shows it.

    Attributes
    ----------
    value : the value; may be None
    none : the words that the control shows for None, such as "off" or "automatic (20)"
    """

    value: Any
    none: str


def shown(option: Option, given: Mapping[str, Any], tracer: Tracer) -> Shown:
    """Return an option's value for a control.

    Parameters
    ----------
    given : the options that the user gave
    tracer : a tracer with these options
    """
    if option.name in given:
        value = given[option.name]
    elif option.default is None and option.unset == AUTOMATIC:
        value = None
    else:       # other options, such as ``era``, may imply the value
        value = tracer.options.get(option.name, option.default)
    return Shown(value, _words_for_none(option, tracer))


def written(value: Any) -> str:
    """Return a value's text, as `Option.parse` reads it."""
    return ",".join(map(str, value)) if isinstance(value, tuple) else spell(value)


def _words_for_none(option: Option, tracer: Tracer) -> str:
    if option.unset != AUTOMATIC:
        return option.unset
    value = _automatic(option.name, tracer)
    return AUTOMATIC if value is None else f"{AUTOMATIC} ({written(value)})"


def _automatic(name: str, tracer: Tracer) -> Any:
    """Return the value that the tracer chose for an option; None if unknown."""
    session = tracer.session
    if name == "step_cap":
        return session.step_cap
    if name == "mask_interval":
        return getattr(session.driver, "mask_interval", None)
    if name in ("storage", "arithmetic"):
        return tracer.options[name]
    if name == "precision" and tracer.options["storage"] == tracer.options["arithmetic"]:
        return tracer.options["storage"]
    return session.accelerator.automatic.get(name)
