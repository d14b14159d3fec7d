"""``gpgpu-rt render --integrator --explain``: what a picture is to show, and what that takes."""
from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from ..render.integrators import DEFAULT, INTEGRATORS, find_integrator
from ..render.plan import Plan
from ..scene.scene import Scene
from ..tracer import Tracer
from .camera import camera_of
from .progress import doublings, told
from .shared import Variants, add_variants, parsed, variants


def add_picture(sub: argparse.ArgumentParser) -> None:
    """The options of ``render`` that are about light."""
    group = sub.add_argument_group("light")
    group.add_argument("--integrator", metavar="NAME", help=f"{', '.join(INTEGRATORS)}; default "
                       f"{DEFAULT}")
    group.add_argument("--explain", action="store_true", help="print the plan before drawing: "
                       "passes, textures, defines, and why the others were left out")
    add_variants(group, light_options(), "picture_")


def picture_options(chosen: argparse.Namespace) -> dict[str, Any]:
    """What `Tracer.render` takes besides camera and size; OptionError for an option that the
    integrator has not."""
    kind = find_integrator(chosen.integrator)
    return {"integrator": kind.name, **parsed(chosen, "picture_", light_options(), kind.options,
                                              f"integrator {kind.name}")}


def drawing_of(chosen: argparse.Namespace, scene: Scene) -> dict[str, Any]:
    """All that `Tracer.render` takes from the command line."""
    return {"camera": camera_of(chosen, scene.camera), "size": chosen.size,
            "first_hits": chosen.first_hits, **picture_options(chosen)}


def explain(chosen: argparse.Namespace, tracer: Tracer) -> Plan | None:
    """The plan, printed unless JSON will hold it; None where it was not asked for."""
    if not chosen.explain:
        return None
    plan = tracer.plan(chosen.size, **picture_options(chosen))
    if not chosen.json:
        print("\n".join(plan.lines()), flush=True)
    return plan


@contextmanager
def progress_shown() -> Iterator[Callable[[int, int, float], None]]:
    """What `Tracer.render` is to tell its progress."""
    with told("sample", doublings("sample")) as tell:
        yield lambda done, samples, noise: tell(
            done, samples, "" if noise == float("inf") else f"noise {noise:.1%}")


def light_options() -> Variants:
    """Every option of every integrator, by name, the default one's first."""
    kinds = sorted(INTEGRATORS.values(), key=lambda kind: kind.name != DEFAULT)
    return variants((kind.name, kind.options) for kind in kinds)
