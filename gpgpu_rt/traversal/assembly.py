"""Assembly: makes the driver of a method, and the stages that run before the driver."""
from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from importlib.util import find_spec

from ..errors import MethodError, OptionError
from .driver import Driver, Setup
from .era import EraTraversal
from .own_arrays import check_own_arrays
from .schedules import Traversal
from .stages.entry_points import EntryPoints
from .stages.packet_entries import PacketEntries
from .stages.sorted_rays import SortedRays


def make_driver(setup: Setup) -> Driver:
    """Return the driver for the method, the schedule and the stages of ``setup``.

    ``Method.drivers`` names the driver's class for a schedule. The default is
    `schedules.Traversal`, or with the option ``era``, `era.EraTraversal`. If options ask for entry
    points or sorted rays, the drivers of these stages wrap the method's driver.

    Raises
    ------
    OptionError
        for the era form on OpenGL ES
    MethodError
        as ``driver_class``
    """
    check_own_arrays(setup.gpu, setup.method, setup.options)
    if setup.options["era"] and setup.gpu.is_es:
        raise OptionError("the era form needs desktop OpenGL, but ANGLE has OpenGL ES; leave out "
                          "--era, or choose another context")
    plain = EraTraversal if setup.options["era"] else Traversal
    named = setup.method.drivers.get(str(setup.options["schedule"]), plain)
    driver = driver_class(named)(setup)
    if setup.options.get("entry_points"):
        driver = (PacketEntries if setup.method.packet else EntryPoints)(setup, driver)
    return SortedRays(setup, driver) if setup.options["sort_rays"] else driver


def driver_class(named: str | Callable[[Setup], Driver]) -> Callable[[Setup], Driver]:
    """Return the class of a driver from an entry of ``Method.drivers``.

    The entry is the class itself, or the string ``module.Class`` for a class in ``traversal/``.

    Raises
    ------
    MethodError
        if ``traversal/`` does not have the named class
    """
    if not isinstance(named, str):
        return named
    module, _, name = named.partition(".")
    place = f"{__package__}.{module}"
    there = module.isidentifier() and find_spec(place)
    found = getattr(import_module(place), name, None) if there else None
    if found is None:
        raise MethodError(f"no driver {named!r} in gpgpu_rt/traversal; give the class itself, or "
                          "its name there as module.Class, such as packets.PacketTraversal")
    return found
