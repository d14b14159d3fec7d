"""Candidates of `tune`: a candidate is a method with values for its knobs.

An option of a method or of the tracer is a knob if it has choices, is a switch, or names values
to try (``tried``), with a few exceptions (`_is_knob`). So a new option becomes a knob when it is
declared.
"""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ..methods import find_method, option_table
from ..options import Option

# These knobs change the hits, as do options with `relaxed` values, with which a search may lose
# hits. Other knobs change only time and memory: the software renderer returns identical hits.
_ACCURACY = ("precision", "storage", "rounding", "intersection", "interval")
# `_is_knob` excludes these options. Statistics, the context and the build device do not change a
# trace. `speed_knobs` adds the schedules, and `accuracy_knobs` storage. Lower arithmetic alone
# saves nothing. The era form (docs/era.md) is slower. Rasterised bounds apply to pictures only,
# but candidates are measured on ray arrays.
_NO_KNOBS = ("era", "statistics", "context", "storage", "arithmetic", "schedule",
             "build_device", "rasterised_bounds")
# A build takes longer than tracing the rays of a timing, so these knobs are tried last.
_BUILDS = ("build", "split", "reinsertion")
_STEPS = (16, 64)       # values of the option steps_per_pass to try
FULL_PRECISION = (None, "fp32")
# The step cap of a candidate with lower accuracy is this many times the largest number of steps of
# any ray at full accuracy.
STEP_ROOM = 8


@dataclass(frozen=True)
class Candidate:
    """A method and the options that differ from its defaults, ready for `Tracer`."""

    method: str
    options: tuple[tuple[str, Any], ...] = ()

    def changed(self, **options: Any) -> Candidate:
        """Return the candidate with changed options; an option at its default is dropped."""
        defaults = {name: option.default for name, option in option_table(self.method).items()}
        defaults["schedule"] = _own_schedule(self.method)
        merged = {**dict(self.options), **options}
        return Candidate(self.method, tuple(sorted(
            (name, value) for name, value in merged.items() if value != defaults[name])))

    @property
    def accuracy(self) -> tuple[tuple[str, Any], ...]:
        """The candidate's options that change the hits."""
        table = option_table(self.method)
        return tuple(pair for pair in self.options if _is_for_accuracy(table[pair[0]]))

    def full_options(self) -> dict[str, Any]:
        """Return the candidate's options, and the defaults (except None) of all other knobs. So a
        saved candidate stays the same when a default changes.
        """
        table, given = option_table(self.method), dict(self.options)
        knobs = {name: option.default for name, option in table.items()
                 if _is_knob(option) and option.default is not None}
        return {"schedule": _own_schedule(self.method), **knobs, **given}

    def __str__(self) -> str:
        return " ".join([self.method, *(f"{name}={value}" for name, value in self.options)])


def speed_knobs(method: str) -> list[list[dict[str, Any]]]:
    """Return, for each knob that changes only time and memory, the changes to try."""
    row = find_method(method)
    schedules: list[dict[str, Any]] = []
    for schedule in row.schedules:
        if schedule == "step":
            schedules += [{"schedule": schedule, "steps_per_pass": steps} for steps in _STEPS]
        else:
            schedules.append({"schedule": schedule})
    table = option_table(method)
    knobs = [option for option in table.values()
             if _is_knob(option) and not _is_for_accuracy(option)]
    own = [[{**_needed(option, table), option.name: value} for value in _values(option)
            if value != option.default]
           for option in sorted(knobs, key=lambda option: option.name in _BUILDS)]
    return [schedules, *own]


def accuracy_knobs(method: str) -> list[list[dict[str, Any]]]:
    """Return, for each knob that changes the hits, the changes to try.

    Precision, storage and rounding are a single knob, because only a format below fp32 has a
    choice of rounding.
    """
    table = option_table(method)
    ways: list[dict[str, Any]] = [{}]
    if "rounding" in table:
        ways = [{"rounding": way} for way in _values(table["rounding"])]
    formats, others = [], []
    for name, option in table.items():
        if name in ("precision", "storage"):
            formats += [{name: value, **way} for value in option.choices or ()
                        if value not in FULL_PRECISION for way in ways]
        elif name != "rounding" and _is_knob(option) and _is_for_accuracy(option):
            others.append([{name: value} for value in _values(option)[1:]])
    return [*others, formats]


def precisions(method: str) -> list[str]:
    """Return the values of a method's option ``precision``; for a method without it, "fp32"."""
    option = option_table(method).get("precision")
    if option is None:
        return ["fp32"]
    return ["fp32", *(str(v) for v in option.choices or () if v not in FULL_PRECISION)]


def _own_schedule(method: str) -> str:
    """Return the schedule that `Tracer` uses for a method by default."""
    row, default = find_method(method), option_table(method)["schedule"].default
    return str(default if default in row.schedules else row.schedules[-1])


def _is_knob(option: Option) -> bool:
    """Return whether an option is a knob: it has choices, is a switch or names values to try,
    _NO_KNOBS does not name it, and it does not require other options to have their defaults
    (``excludes``)."""
    return (option.name not in _NO_KNOBS and not option.excludes
            and (option.choices is not None or option.kind is bool or bool(option.tried)))


def _needed(option: Option, table: dict[str, Option]) -> dict[str, Any]:
    """Return the value of another option without which a number to try has no meaning, by name."""
    if not option.tried or option.goes_with is None:
        return {}
    name, values = option.goes_with
    return {} if table[name].default in values else {name: values[0]}


def _is_for_accuracy(option: Option) -> bool:
    return option.name in _ACCURACY or bool(option.relaxed)


def _values(option: Option) -> list[Any]:
    """Return the values of a knob, the default first. If the option is ``optional``, ``None`` is a
    value."""
    values = [False, True]
    if option.choices is not None:
        values = list(option.choices)
    elif option.tried:
        values = [option.default, *option.tried]
    if option.optional and None not in values:
        values.append(None)
    return sorted(values, key=lambda value: value != option.default)
