"""Rows of the method table: a row holds everything that other packages know about a method."""
from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import OptionError
from ..gl.packed_record import PackedRecord
from ..gl.record import Record
from ..options import (
    ERA_TARGETS, OFF, TEXEL_POINTERS, TRACER_OPTIONS, Option, resolve_options, spell, with_era
)
from ..rays.records import HIT
from .accelerator import Accelerator
from .era_packet_form import EraPackets
from .triangle_table import REFERENCE

Tables = tuple[Record | PackedRecord, ...]
SCHEDULES = ("kernels", "step", "loop")
PACKET = Option("packet", (2, 2), "rays per fragment", tuple,
                choices=((1, 1), (2, 1), (2, 2), (4, 2), (4, 4)), label="rays per packet")
VERTEX_CULLING = Option("vertex_culling", False, "skip triangles of a leaf that lie outside the "
                        "frustum around the packet's rays", bool, schedules=("loop",),
                        label="cull by packet frustum")

ENTRY_POINTS = Option(
    "entry_points", None, "start rays at the nodes that a beam around their 4x4 tile found; with "
    "16, beams around 16x16 tiles search first, and beams around 4x4 tiles refine the result", int,
    choices=(16, 4), optional=True, label="start below the root", unset=OFF)
PACKET_ENTRIES = Option(
    "entry_points", None, "side of tiles in rays; a beam bounds a tile's rays. A packet whose "
    "rays all lie in the beam of its tile starts where the beam enters the tree", int,
    choices=(8, 16, 32), optional=True, schedules=("loop",), label="start below the root",
    unset=OFF)


# A stack's array has a multiple of this number of levels, so that trees of similar depth share
# programs. Unused levels cost no time on llvmpipe.
STACK_STEP = 8


def stack_defines(levels: int) -> dict[str, object]:
    """Return the GLSL define for the array of a stack with at most ``levels`` levels."""
    return {"STACK_SIZE": -(-levels // STACK_STEP) * STACK_STEP}


@dataclass(frozen=True)
class Part:
    """Chooses the file that replaces ``#include <name>`` in a method's GLSL.

    Attributes
    ----------
    name : str, the name of the include
    option : str, the option whose value chooses the file
    plain : file under ``glsl/`` for every value that no key of ``files`` matches
    files : value -> file under ``glsl/``. The key True also matches each true value that has no
        key of its own
    """

    name: str
    option: str
    plain: str
    files: Mapping[Any, str]

    def file(self, options: Mapping[str, Any]) -> str:
        """Return the file for these options."""
        value = options.get(self.option)
        return self.files.get(value, self.files.get(True, self.plain) if value else self.plain)


# Choose how a ray finds the end of a leaf's references.
LEAF_LIST = Part("leaf_list", "era", "core/list_counted.glsl",
                 dict.fromkeys(TEXEL_POINTERS, "era/list_marked.glsl"))
# Choose how a packet's rays test a triangle, and whether a packet may skip triangles.
TRIANGLE_TESTS = Part("triangle_tests", "intersection", "drivers/triangle_by_ray.glsl",
                      {"woop-watertight": "drivers/triangle_by_axes.glsl"})
CULLING = Part("culling", "vertex_culling", "drivers/cull_nothing.glsl",
               {True: "drivers/vertex_culling.glsl"})


@dataclass(frozen=True)
class Stepwise:
    """The parts that a packet method needs under the schedule ``step``.

    Attributes
    ----------
    state : the record that a packet carries from pass to pass
    kernels : the kernels that a packet can wait for, in the order of the packet's phases
    glsl : file under ``glsl/`` with a packet's kernels, for drivers/packet_visit.frag
    ray : file under ``glsl/`` with a ray's step, for drivers/packet_intersect.frag
    stack_entry : the record of a level of the packet's stack, if the stack is in an atlas
        (stack_atlas.py)
    """

    state: Record
    kernels: tuple[str, ...]
    glsl: str
    ray: str
    stack_entry: Record | None = None


@dataclass(frozen=True)
class Method:
    """A ray tracing method of Hachisuka's survey.

    Attributes
    ----------
    name : The method's name, as users write it.
    summary : A line that says what the method does.
    citation : A line that names the paper, as the survey cites it.
    glsl : File under ``glsl/`` (or an absolute path) with ``init`` and the kernels.
    parts : The files that options choose for ``#include <name>`` in the GLSL.
    kernels : Names of the kernels in the order of their phases.
    state : Record of a ray's state between passes. It has the fields ``phase`` and ``steps``, and
        in a user's row at most 6 texels.
    tables : Records of the tables that the programs read.
    choose_tables : (options) -> records, if an option replaces a table.
    prepare : (triangles (n, 3, 3) float32, options) -> Accelerator.
    adopt : (structure, triangles, options) -> Accelerator. Like ``prepare``, but with a structure
        that another method has built. The other method hands some of its rays to this method.
    refit : (accelerator, triangles, options) -> Accelerator with the same structure over moved
        triangles. If None, or if ``rebuild_ratio`` requires it, the tracer rebuilds the structure.
    options : The method's own options, including the builder's.
    form : (row, options) -> the row that replaces this row, if an option changes the state, the
        kernels or the drivers.
    schedules : The schedules that the method supports, the best schedule last.
    drivers : Schedule -> the driver's class, or a name ``module.Class`` in ``traversal/``.
        Without an entry, the driver is `schedules.Traversal`, or `era.EraTraversal` with ``era``.
    stack_entry : Record of a level of a stack in textures, if the method has such a stack.
    packet_state : (options) -> Stepwise, for a packet method that runs under ``step``.
    era_packets : The packets in the era form, if the method has them.
    single : Name of the method that traces a packet's rays singly after the packet's step limit.
    entry_walk : GLSL file of a beam's walk through the tree, for ``entry_points``.
    own_array : (options) -> whether neighbouring fragments may write to different indices of a
        local GLSL array.
    fixed_defines : GLSL defines of all programs of this method, for methods that share a GLSL
        file.
    no_era_form : why the kernels do not compile in the era dialect (traversal/era.py), or empty.
    stack, packet, dynamic : Columns of the survey's Table 1.
    restarts : Whether a ray may jump from a leaf back to an ancestor. The page in a browser and
        the heat maps count such jumps.
    """

    name: str
    summary: str
    citation: str
    glsl: str | Path
    kernels: tuple[str, ...]
    state: Record
    tables: Tables
    prepare: Callable[[np.ndarray, Mapping[str, Any]], Accelerator]
    adopt: Callable[[Any, np.ndarray, Mapping[str, Any]], Accelerator] | None = None
    refit: Callable[[Accelerator, np.ndarray, Mapping[str, Any]], Accelerator] | None = None
    options: tuple[Option, ...] = ()
    parts: tuple[Part, ...] = ()
    form: Callable[[Method, Mapping[str, Any]], Method] | None = None
    choose_tables: Callable[[Mapping[str, Any]], Tables] | None = None
    schedules: tuple[str, ...] = SCHEDULES
    drivers: Mapping[str, str | Callable[..., Any]] = field(default_factory=dict)
    stack_entry: Record | None = None
    packet_state: Callable[[Mapping[str, Any]], Stepwise] | None = None
    era_packets: EraPackets | None = None
    single: str | None = None
    entry_walk: str | None = None
    own_array: Callable[[Mapping[str, Any]], bool] | None = None
    stack: bool = False
    packet: bool = False
    dynamic: bool = False
    restarts: bool = False
    fixed_defines: Mapping[str, object] = field(default_factory=dict)
    no_era_form: str = ""

    @property
    def year(self) -> str:
        """The year of the paper, at the end of the citation; "" if there is none."""
        year = self.citation[-4:]
        return year if year.isdecimal() else ""

    def why_no_era_form(self, era: str | bool = True) -> str:
        """Return why the row has no era form (traversal/era.py) with default options, or "" if the
        row has one. ``era`` is a chip, or True for any chip."""
        return self._with_form({"era": era})._why_not_era(era)

    def era_targets(self, era: str | bool) -> int:
        """Return the number of render targets of the era form's kernels with default options."""
        return self._with_form({"era": era})._era_state(era).texels + HIT.texels

    def has_texel_pointers(self, era: str | bool | None) -> bool:
        """Return whether pointers are columns and rows in the era form for a chip. A method of a
        user keeps indices: only the kernels under ``glsl/`` are written for columns and rows."""
        return era in TEXEL_POINTERS and not Path(self.glsl).is_absolute()

    def _era_state(self, era: str | bool) -> Record:
        """Return the state in the era form: it has no step count and, with marked lists
        (leaf_lists.py), no list's end."""
        state = self.state.without("steps")
        if not self.has_texel_pointers(era):
            return state
        return (state.without("end") if LEAF_LIST in self.parts else state).with_texel_pointers()

    def _why_not_era(self, era: str | bool) -> str:
        targets = self._era_state(era).texels + HIT.texels
        if self.no_era_form or self.era_packets is not None:
            return self.no_era_form
        if self.packet:
            return "no kernels that trace packets of its rays were written for the papers' cards"
        if "kernels" not in self.schedules or "kernels" in self.drivers:
            return "its rays do not run one kernel in each pass"
        if targets > ERA_TARGETS:
            return f"its kernels write {targets} render targets, and the cards have {ERA_TARGETS}"
        return ""

    @property
    def steps_once(self) -> bool:
        """Whether a pass runs at most one step, because another pass must follow each step."""
        return self.stack_entry is not None or self.packet_state is not None

    def tables_for(self, options: Mapping[str, Any]) -> Tables:
        """Return the records that the method's programs read under these options."""
        records = self.choose_tables(options) if self.choose_tables else self.tables
        if not options.get("era"):
            return records
        records = tuple(record.apart() for record in records if isinstance(record, Record))
        if not self.has_texel_pointers(options["era"]):
            return records
        if LEAF_LIST in self.parts:
            records = tuple(record.extended("last:int") if record.name == REFERENCE.name
                            else record.without("count") for record in records)
        return tuple(record.with_texel_pointers() for record in records)

    def formed(self, options: Mapping[str, Any]) -> Method:
        """Return the row that ``form`` makes for these options. A missing option has its default.

        With the option ``era``, states have no step counts, and the only schedule is ``kernels``,
        or ``loop`` for packets.
        """
        row = self._with_form(options)
        if not options.get("era"):
            return row
        if row.era_packets is not None:
            row.era_packets.check(row.name, options)
            return replace(row, schedules=("loop",), drivers={"loop": row.era_packets.driver},
                           state=row.state.without("steps"))
        era = options["era"]
        if reason := row._why_not_era(era):
            changed = self._changed({**{o.name: o.default for o in self.options}, **options})
            on_any = self._with_form({**options, "era": True})._why_not_era(True)
            chip = "" if on_any else f" for {era}"
            raise OptionError(f"method {self.name}{changed} has no era form{chip}: {reason}")
        entry = row.stack_entry
        if entry is not None and row.has_texel_pointers(era):
            entry = entry.with_texel_pointers()
        return replace(row, state=row._era_state(era), stack_entry=entry, schedules=("kernels",))

    def _with_form(self, options: Mapping[str, Any]) -> Method:
        if self.form is None:
            return self
        return self.form(self, {**{o.name: o.default for o in self.options}, **options})

    def _changed(self, options: Mapping[str, Any]) -> str:
        """Return a clause with the method's own options that are not at their defaults."""
        changed = ", ".join(f"{o.name}={spell(options[o.name])}" for o in self.options
                            if options[o.name] != o.default)
        return f" with {changed}" if changed else ""

    def schedules_for(self, options: Mapping[str, Any]) -> tuple[str, ...]:
        """Return the schedules that support these options. A missing option has its default."""
        return tuple(schedule for schedule in self.formed(options).schedules
                     if all(o.runs_under(options.get(o.name, o.default), schedule)
                            for o in TRACER_OPTIONS + self.options))

    def defines(self, options: Mapping[str, Any]) -> dict[str, object]:
        """Return the GLSL defines that follow from the method and its options."""
        chosen = dict(o.glsl_define(options[o.name]) for o in self.options if o.define)
        return {**self.fixed_defines, **chosen}

    def resolved(self, given: Mapping[str, Any]) -> dict[str, Any]:
        """Return all options of a tracer with this method, each with its given or default value.

        Raises
        ------
        OptionError
            for an unknown option, an invalid value, or options that do not fit together
        """
        known, whose = TRACER_OPTIONS + self.options, f"method {self.name}"
        given = with_era(given, known, whose, {} if self.era_packets is None
                         else self.era_packets.implied(self.options))
        options = resolve_options(given, known, whose)
        for part in ("storage", "arithmetic"):
            options[part] = options[part] or options["precision"] or "fp32"
        formats = {options["storage"], options["arithmetic"]}
        if options["rounding"] != "nearest" and formats == {"fp32"}:
            raise OptionError(f"rounding={options['rounding']} applies to fp24 and fp16, but "
                              "all numbers are fp32; give a precision too, or leave rounding out")
        self.check_schedule(options, "schedule" in given)
        return options

    def takes(self, given: Mapping[str, Any]) -> bool:
        """Return whether ``resolved`` accepts the options ``given``."""
        try:
            self.resolved(given)
        except OptionError:
            return False
        return True

    def check_schedule(self, options: dict[str, Any], asked: bool) -> None:
        """Check the schedule in ``options``. ``asked`` tells whether the caller gave a schedule.

        If the default schedule is not supported, replace it by the method's best schedule.

        Raises
        ------
        OptionError
            if these options do not allow the schedule or ``steps_per_pass``
        """
        schedules = self.schedules_for(options)
        if not asked and options["schedule"] not in schedules:
            options["schedule"] = schedules[-1]
        if options["schedule"] not in schedules:
            given = "" if schedules == self.schedules else " with " + ", ".join(
                f"{o.name}={spell(options[o.name])}" for o in TRACER_OPTIONS + self.options
                if options[o.name] != o.default and (o in self.options or o.schedules))
            raise OptionError(f"method {self.name}{given} runs under {', '.join(schedules)} only, "
                              f"not {options['schedule']}")
        if self.steps_once and options["steps_per_pass"] != 1:
            raise OptionError(f"method {self.name} runs one step per pass, because another pass "
                              "follows each step; leave steps_per_pass at 1")

    def in_passes(self, options: Mapping[str, Any], single: bool = False) -> dict[str, Any]:
        """Return the options with a schedule of many passes, so that passes can be observed.

        If the method supports only ``loop``, the schedule is unchanged. With ``single``, a pass
        runs one step.
        """
        schedules = self.schedules_for(options)
        asked = options.get("schedule", "loop")
        fit = [s for s in (asked, "step", "kernels") if s in schedules and s != "loop"]
        found = {**options, **({"schedule": fit[0]} if fit else {})}
        if single:
            found.pop("steps_per_pass", None)
        return found

    def to_dict(self) -> dict[str, Any]:
        """Return the row as plain data, for tables and JSON."""
        return {"name": self.name, "summary": self.summary, "citation": self.citation,
                "kernels": list(self.kernels), "schedules": list(self.schedules),
                "options": {o.name: o.default for o in self.options}, "stack": self.stack,
                "packet": self.packet, "dynamic": self.dynamic, "refit": self.refit is not None,
                "era_form": not self.why_no_era_form()}


def nothing_kept(prepare: Callable[[np.ndarray, Mapping[str, Any]], Accelerator]
                 ) -> Callable[[Accelerator, np.ndarray, Mapping[str, Any]], Accelerator]:
    """Return the ``refit`` of a method that keeps no structure."""
    return lambda accelerator, triangles, options: prepare(triangles, options)


def check_culling(options: Mapping[str, Any]) -> None:
    """Raise OptionError for vertex culling without the watertight test: other tests could lose
    hits, because their rounding has no bound."""
    if options.get("vertex_culling") and options["intersection"] != "woop-watertight":
        raise OptionError("vertex_culling is exact only for the watertight test; set "
                          "intersection=woop-watertight too")


def with_entries(more: str) -> Callable[[Method, Mapping[str, Any]], Method]:
    """Return the ``form`` of a row whose rays visit a list of subtrees if entry points are on. The
    form adds the kernel ``enter``, which starts the next subtree, and adds the fields ``more`` to
    the state."""
    def formed(row: Method, options: Mapping[str, Any]) -> Method:
        if not options["entry_points"]:
            return row
        return replace(row, kernels=("enter", *row.kernels), state=row.state.extended(more))
    return formed
