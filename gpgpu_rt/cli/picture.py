"""``gpgpu-rt render --integrator --explain``: choose how light is computed, and print the plan."""
from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from ..options import Option
from ..render.integrators import DEFAULT, INTEGRATORS, find_integrator
from ..render.plan import Plan
from ..scene.scene import Scene
from ..tracer import Tracer
from .camera import camera_of
from .help import OwnedOptions, Variants, variants
from .parser import Parser
from .progress import doublings, show_progress
from .shared import add_variants, parsed


def add_picture(sub: Parser) -> None:
    group = sub.add_argument_group("light")
    group.add_argument("--integrator", metavar="NAME", help="the integrator: "
                       f"{', '.join(INTEGRATORS)}; default {DEFAULT}")
    sub.rare.add_argument("--explain", action="store_true", help="print the plan before drawing: "
                          "the passes, textures and defines that the scene requires, and why "
                          "others are left out")
    add_variants(sub, group, OwnedOptions("integrator", _integrators(), ("--integrator",)),
                 "picture_")


def picture_options(chosen: argparse.Namespace) -> dict[str, Any]:
    """Return the integrator and its options, as arguments of `Tracer.render`.

    Raises
    ------
    OptionError
        for an option that the integrator does not have
    """
    kind = find_integrator(chosen.integrator)
    return {"integrator": kind.name, **parsed(chosen, "picture_", light_options(), kind.options,
                                              f"integrator {kind.name}")}


def drawing_of(chosen: argparse.Namespace, scene: Scene) -> dict[str, Any]:
    """Return all arguments of `Tracer.render` that the command line determines."""
    return {"camera": camera_of(chosen, scene.camera), "size": chosen.size,
            "first_hits": chosen.first_hits, **picture_options(chosen)}


def explain(chosen: argparse.Namespace, tracer: Tracer) -> Plan | None:
    """Return the plan, or None without --explain. Print the plan, unless --json is given."""
    if not chosen.explain:
        return None
    plan = tracer.plan(chosen.size, **picture_options(chosen))
    if not chosen.json:
        print("\n".join(plan.lines()), flush=True)
    return plan


@contextmanager
def progress_shown() -> Iterator[Callable[[int, int, float], None]]:
    """Yield a function to which `Tracer.render` reports its progress."""
    with show_progress("sample", doublings("sample")) as tell:
        yield lambda done, samples, noise: tell(
            done, samples, "" if noise == float("inf") else f"noise {noise:.1%}")


def light_options() -> Variants:
    """Return the integrators' options by name, the default integrator's first."""
    return variants(_integrators())


def _integrators() -> list[tuple[str, Sequence[Option]]]:
    kinds = sorted(INTEGRATORS.values(), key=lambda kind: kind.name != DEFAULT)
    return [(kind.name, kind.options) for kind in kinds]
