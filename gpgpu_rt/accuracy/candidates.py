"""Candidates: a method with values for its knobs, and which knobs there are.

Knobs are taken from the option tables: every option of a method or of the tracer that has choices
or is a switch, so that a new option joins by being declared.
"""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ..methods import find_method
from ..options import TRACER_OPTIONS, Option

# Knobs that change what is hit and where. All others change time and bytes alone: hits stay the
# same, to the bit where arithmetic is exact.
_ACCURACY = ("precision", "storage", "rounding", "intersection", "interval")
# No knobs of their own: how a call is watched, what precision sets both of, and how that rounds;
# and where the same build runs.
# Rasterised bounds are for pictures; what is measured here are arrays of rays.
_NO_KNOBS = ("statistics", "context", "storage", "arithmetic", "schedule", "build_device",
             "rasterised_bounds")
_STEPS = (16, 64)
FULL_PRECISION = (None, "fp32")
STEP_ROOM = 8   # steps of a relaxed candidate over the most a ray takes at full accuracy


@dataclass(frozen=True)
class Candidate:
    """A method and the options that differ from its defaults, ready for `Tracer`."""

    method: str
    options: tuple[tuple[str, Any], ...] = ()

    def changed(self, **options: Any) -> Candidate:
        """The same with some options changed; one at its default is dropped."""
        defaults = {name: option.default for name, option in option_table(self.method).items()}
        defaults["schedule"] = _own_schedule(self.method)
        merged = {**dict(self.options), **options}
        return Candidate(self.method, tuple(sorted(
            (name, value) for name, value in merged.items() if value != defaults[name])))

    @property
    def accuracy(self) -> tuple[tuple[str, Any], ...]:
        """Those of its options that change what is hit."""
        table = option_table(self.method)
        return tuple(pair for pair in self.options if _is_for_accuracy(table[pair[0]]))

    def full_options(self) -> dict[str, Any]:
        """Every knob with its value, defaults spelled out, so that a later default changes
        nothing."""
        table, given = option_table(self.method), dict(self.options)
        knobs = {name: option.default for name, option in table.items()
                 if _is_knob(option) and option.default is not None}
        return {"schedule": _own_schedule(self.method), **knobs, **given}

    def __str__(self) -> str:
        return " ".join([self.method, *(f"{name}={value}" for name, value in self.options)])


def option_table(method: str) -> dict[str, Option]:
    """The options of a method and of the tracer, by name."""
    return {option.name: option for option in TRACER_OPTIONS + find_method(method).options}


def speed_knobs(method: str) -> list[list[dict[str, Any]]]:
    """For each knob that changes time and bytes alone, the changes that may be tried."""
    row = find_method(method)
    schedules: list[dict[str, Any]] = []
    for schedule in row.schedules:
        if schedule == "step":
            schedules += [{"schedule": schedule, "steps_per_pass": steps} for steps in _STEPS]
        else:
            schedules.append({"schedule": schedule})
    own = [[{name: value} for value in _values(option) if value != option.default]
           for name, option in option_table(method).items()
           if _is_knob(option) and not _is_for_accuracy(option)]
    return [schedules, *own]


def accuracy_knobs(method: str) -> list[list[dict[str, Any]]]:
    """For each knob that changes what is hit, the changes that may be tried.

    Precision, storage alone and rounding are one knob: IEEE single rounds one way only, and
    arithmetic below what is stored buys nothing.
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
    """The values of the option ``precision``; "fp32" alone where there is none."""
    option = option_table(method).get("precision")
    if option is None:
        return ["fp32"]
    return ["fp32", *(str(v) for v in option.choices or () if v not in FULL_PRECISION)]


def _own_schedule(method: str) -> str:
    """The schedule a method runs under unless another is asked for, as `Tracer` has it."""
    row, default = find_method(method), option_table(method)["schedule"].default
    return str(default if default in row.schedules else row.schedules[-1])


def _is_knob(option: Option) -> bool:
    """One that excludes others is another way of tracing, not a knob of this one."""
    return (option.name not in _NO_KNOBS and not option.excludes
            and (option.choices is not None or option.kind is bool))


def _is_for_accuracy(option: Option) -> bool:
    return option.name in _ACCURACY or bool(option.relaxed)


def _values(option: Option) -> list[Any]:
    """The values of a knob, its default first; None only where it means something of its own."""
    values = list(option.choices) if option.choices is not None else [False, True]
    if option.optional and None not in values:
        values.append(None)
    return sorted(values, key=lambda value: value != option.default)
