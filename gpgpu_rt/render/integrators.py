"""Integrators: the table of all integrators by name."""
from __future__ import annotations

from ..errors import OptionError, nearest_names
from .direct import Direct
from .integrator import Integrator
from .path import Path
from .whitted import Whitted

INTEGRATORS: dict[str, type[Integrator]] = {kind.name: kind for kind in (Direct, Whitted, Path)}
DEFAULT = Whitted.name


def find_integrator(name: str | None) -> type[Integrator]:
    """Return the integrator with this name, by default Whitted. Raise OptionError for an unknown
    name."""
    if name is None:
        return INTEGRATORS[DEFAULT]
    if not isinstance(name, str) or name not in INTEGRATORS:
        raise OptionError(f"no integrator {name!r}{nearest_names(name, INTEGRATORS)}")
    return INTEGRATORS[name]
