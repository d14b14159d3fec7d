"""``gpgpu-rt render --integrator --explain``: what a picture is to show, and what that takes."""
from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

from ..integrators import DEFAULT, INTEGRATORS, find_integrator
from ..integrators.plan import Plan
from ..options import Option, spell
from ..tracer import Tracer
from .shared import add_option, parsed, say


def add_picture(sub: argparse.ArgumentParser) -> None:
    """The options of ``render`` that are about light."""
    group = sub.add_argument_group("light")
    group.add_argument("--integrator", metavar="NAME", help=f"{', '.join(INTEGRATORS)}; default "
                       f"{DEFAULT}")
    group.add_argument("--explain", action="store_true", help="print the plan before drawing: "
                       "passes, textures, defines, and why the others were left out")
    for name, option in light_options().items():
        others = [f"{kind.name} {spell(other.default)}" for kind in INTEGRATORS.values()
                  for other in kind.options
                  if other.name == name and other.default != option.default]
        told = f"{option.help} (by {', '.join(others)})" if others else option.help
        add_option(group, replace(option, help=told), "picture_")


def picture_options(chosen: argparse.Namespace) -> dict[str, Any]:
    """What `Tracer.render` takes besides camera and size; OptionError for an option that the
    integrator has not."""
    kind = find_integrator(chosen.integrator)
    return {"integrator": kind.name, **parsed(chosen, "picture_", light_options(), kind.options,
                                              f"integrator {kind.name}")}


def explain(chosen: argparse.Namespace, tracer: Tracer) -> Plan | None:
    """The plan, printed unless JSON will hold it; None where it was not asked for."""
    if not chosen.explain:
        return None
    plan = tracer.plan(chosen.size, **picture_options(chosen))
    if not chosen.json:
        print("\n".join(plan.lines()), flush=True)
    return plan


@contextmanager
def progress_shown(chosen: argparse.Namespace) -> Iterator[Callable[[int, int, float], None]]:
    """What `Tracer.render` is to tell its progress: a bar where tqdm is installed and someone
    looks on; else a line for each doubling of the samples."""
    try:
        from tqdm import tqdm
    except ImportError:
        yield _doublings()
        return
    bar = None

    def move(done: int, samples: int, noise: float) -> None:
        nonlocal bar
        if bar is None:
            bar = tqdm(total=samples, unit="sample", dynamic_ncols=True, disable=None)
        bar.set_postfix_str("" if noise == float("inf") else f"noise {noise:.1%}", refresh=False)
        bar.update(done - bar.n)

    try:
        yield move
    finally:
        if bar is not None:
            bar.close()


def _doublings() -> Callable[[int, int, float], None]:
    told = 0

    def tell(done: int, samples: int, noise: float) -> None:
        nonlocal told
        if done >= 2 * told or done == samples:
            told = done
            say(f"{done:,} of {samples:,} samples a pixel"
                + ("" if noise == float("inf") else f", noise {noise:.1%}"))

    return tell


def light_options() -> dict[str, Option]:
    """Every option of every integrator, by name; of several so called, the default one's."""
    kinds = sorted(INTEGRATORS.values(), key=lambda kind: kind.name == DEFAULT)
    return {option.name: option for kind in kinds for option in kind.options}
