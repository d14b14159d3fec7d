"""Options: an option's name is a keyword argument, the word ``--name``, and a JSON key."""
from __future__ import annotations

import inspect
import operator
import textwrap
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from .errors import OptionError, did_you_mean, nearest_names
from .gl.precision import PRECISIONS, ROUNDINGS

AUTOMATIC, OFF = "automatic", "off"     # words for the value None; see `Option.unset`


@dataclass(frozen=True)
class Option:
    """An option: its name, its values and its meaning.

    Attributes
    ----------
    name : The keyword argument and JSON key. The command line writes the name with hyphens.
    default : The value that applies if the caller gives no value.
    help : The text for users. The text after "default:" explains the default None.
    kind : The type of a value. Unused if ``choices`` is not None.
    words : Valid words besides the values of ``kind``.
    choices : All valid values; None if ``kind`` decides.
    minimum, maximum : Bounds of a number, both included.
    optional : Whether None is valid although the default is another value.
    define : The name of the GLSL macro that the option defines, or None. A switch defines the
        macro if it is true. A number is the macro's value. A word such as ``fast`` defines a macro
        whose name ends with ``_FAST``.
    relaxed : Choices that only measurements use: with them, a search may lose hits.
    tried : Values of a number that `tune` tries beside the default.
    excludes : If this option differs from its default, these options must have their defaults.
    schedules : The schedules that allow a value other than the default. Empty for all schedules.
    goes_with : (name, values) of another option. With other values, this option has no meaning.
    common : Whether many users need the option. A command's short help lists only such options.
    label : A few plain words for a control of the viewer. Empty if ``name`` with spaces for
        underscores is plain enough; see ``title``.
    meanings : (choice, a few words) for choices whose spelling does not explain itself.
    unset : The word for None in a control: "automatic" if something else decides the value, or
        "off" if None turns a feature off.
    """

    name: str
    default: Any
    help: str
    kind: type = str
    words: tuple[str, ...] = ()
    choices: tuple[Any, ...] | None = None
    minimum: float | None = None
    maximum: float | None = None
    optional: bool = False
    define: str | None = None
    relaxed: tuple[Any, ...] = ()
    tried: tuple[Any, ...] = ()
    excludes: tuple[str, ...] = ()
    schedules: tuple[str, ...] = ()
    goes_with: tuple[str, tuple[Any, ...]] | None = None
    common: bool = False
    label: str = ""
    meanings: tuple[tuple[Any, str], ...] = ()
    unset: str = AUTOMATIC

    @property
    def title(self) -> str:
        """Return the words that name the option beside a control."""
        return self.label or self.name.replace("_", " ")

    def choice_words(self, choice: Any) -> str:
        """Return a choice as a list shows it: its spelling, and its meaning if it has one."""
        if choice is None:
            return self.unset
        meaning = dict(self.meanings).get(choice)
        return f"{spell(choice)}: {meaning}" if meaning else spell(choice)

    def glsl_define(self, value: Any) -> tuple[str, object]:
        """Return the name of the define for a value, and the value of the define."""
        if isinstance(value, str):
            return word_define(str(self.define), value), True
        return str(self.define), value

    def check(self, value: Any) -> Any:
        """Return the value, converted to the option's type if the conversion loses nothing.

        A choice may be given as the command line spells it: "4x2" for (4, 2).

        Raises
        ------
        OptionError
            for an invalid value; the message names the valid values
        """
        if value is None and (self.optional or self.default is None):
            return None
        if self.choices is not None:
            value = tuple(value) if isinstance(value, list) else value
            if isinstance(value, str):
                value = next((c for c in self.choices if spell(c) == value.lower()), value)
            if value not in self.choices:
                known = [spell(c) for c in self.choices]
                raise OptionError(f"option {self.name}={value!r} is none of {', '.join(known)}"
                                  + (did_you_mean(value, known) if isinstance(value, str)
                                     else ""))
            return value
        if value in self.words:
            return value
        try:
            if self.kind is bool and not isinstance(value, (bool, int)):
                raise TypeError
            converted = {int: operator.index, bool: bool, float: float}.get(
                self.kind, lambda v: v)(value)
        except (TypeError, ValueError, OverflowError) as failure:
            raise OptionError(f"option {self.name}={value!r} must be " + " or ".join(
                [*self.words, self.kind.__name__])) from failure
        if self.minimum is not None and not converted >= self.minimum:
            raise OptionError(f"option {self.name}={value!r} must be at least {self.minimum:g}")
        if self.maximum is not None and not converted <= self.maximum:
            raise OptionError(f"option {self.name}={value!r} must be at most {self.maximum}")
        return converted

    @property
    def values(self) -> str:
        """The valid values, or their type, in words."""
        names = (list(map(repr, self.choices)) if self.choices is not None
                 else [*map(repr, self.words), self.kind.__name__])
        return " or ".join([*names, *(["None"] if self.optional or self.default is None else [])])

    def fits(self, values: Mapping[str, Any]) -> bool:
        """Return whether this option has a meaning with these ``values`` of all options."""
        return self.goes_with is None or values[self.goes_with[0]] in self.goes_with[1]

    def runs_under(self, value: Any, schedule: str) -> bool:
        """Return whether a schedule allows the value."""
        return value == self.default or not self.schedules or schedule in self.schedules

    def accepts(self, value: Any) -> bool:
        """Return whether ``check`` accepts the value."""
        try:
            self.check(value)
        except OptionError:
            return False
        return True

    def parse(self, text: str) -> Any:
        """Return the checked value of a word from the command line."""
        if text.lower() in ("none", "null"):
            return self.check(None)
        if self.choices is not None:
            return self.check(text)
        if self.kind is bool:
            return self.check(TRUTH.get(text.lower(), text))
        if self.kind in (int, float) and text not in self.words:
            try:
                value: Any = self.kind(text)
            except ValueError:
                value = text
            return self.check(value)
        words = text.split(",")
        if self.kind is object and all(word.strip().isdecimal() for word in words):
            numbers = tuple(map(int, words))
            return self.check(numbers if len(numbers) > 1 else numbers[0])
        return self.check(text)


# The words that stand for the values of a switch.
TRUTH = {"1": True, "true": True, "yes": True, "on": True,
         "0": False, "false": False, "no": False, "off": False}

# The chips that the option ``era`` accepts. ``era`` runs the kernels as in the papers: the era
# form (docs/era.md). Each chip implies the schedule of cards without loops, the papers' triangle
# test, and the number format of the chip's fragment processors. NV40 and R580 compute in fp32.
# (NV40 also has half-precision types.) NV30 is missing because it has a single render target, and
# its compiler refuses each of the kernels.
_PAPERS = {"schedule": "kernels", "intersection": "moller-trumbore", "precision": "fp32"}
ERAS: dict[str, dict[str, Any]] = {
    "r300": {**_PAPERS, "precision": "fp24"}, "r420": {**_PAPERS, "precision": "fp24"},
    "nv40": _PAPERS, "r580": _PAPERS}
# The chips whose floats cannot hold the indices of large tables. On these chips, a pointer is the
# column and the row of a texel (glsl/core/pointer.glsl).
TEXEL_POINTERS = tuple(chip for chip, implied in ERAS.items() if implied["precision"] == "fp24")
ERA_TARGETS = 4     # number of render targets of these chips
ERA_LOOPS = ("nv40", "r580")    # the chips that have loops

# A pair of options that exclude each other -> the reason, and what to do.
_WHY_EXCLUDED = {("era", "statistics"): ", because kernels in the era form count nothing; leave "
                 "era out to count the work of today's kernels"}

TRACER_OPTIONS: tuple[Option, ...] = (
    Option("era", None, "run the kernels as the papers had them on a card with this chip: "
           "one kernel per pass, no integers, the chip's number format", choices=tuple(ERAS),
           optional=True,
           excludes=("statistics", "sort_rays", "rasterised_bounds", "entry_points",
                     "quantise_nodes", "step_cap", "steps_per_pass"), label="card of the papers",
           unset=OFF),
    Option("schedule", "loop", "how traversal kernels are run: a pass for each kernel, a pass for "
           "each step, or all steps in one pass", choices=("kernels", "step", "loop"), meanings=(
               ("kernels", "a pass for each kernel"), ("step", "a pass for each step"),
               ("loop", "all steps in one pass")), common=True),
    Option("steps_per_pass", 1, "kernel runs per pass under the step schedule", int, minimum=1,
           schedules=("step",)),
    Option("mask_interval", None, "passes between two counts of the live rays; under kernels, odd "
           "values are rounded down and the minimum is 2; default: set by the schedule", int,
           minimum=1, schedules=("kernels", "step"), label="passes between counts"),
    Option("step_cap", None, "kernel runs after which a ray is stopped and marked as unfinished; "
           "default: a bound computed from the size of the accelerator", int, minimum=1,
           label="step limit of a ray"),
    Option("statistics", False, "count the nodes, leaves and triangles of each ray", bool,
           common=True, label="count nodes, triangles"),
    Option("sort_rays", False, "sort the rays on the GPU before tracing, by their start and end "
           "points", bool, excludes=("presort",), label="sort rays on the GPU"),
    Option("presort", False, "sort ray arrays on the host before the upload, by direction and "
           "origin; the eye rays of a picture are not sorted", bool,
           label="sort rays on the host"),
    Option("rasterised_bounds", None, "bound the hit distance of eye rays by rasterisation, in "
           "tiles of this side in pixels, so that the rays search a shorter interval; default: no "
           "bounds", int, choices=(4, 8, 16), optional=True, unset=OFF),
    Option("intersection", "woop-watertight", "ray-triangle test",
           choices=("woop-watertight", "moller-trumbore", "plucker", "kensler-shirley"),
           label="triangle test"),
    Option("precision", None, "number format of both storage and arithmetic; default: fp32",
           choices=PRECISIONS, optional=True, label="number format"),
    Option("storage", None, "number format of geometric values in textures; default: the value "
           "of precision", choices=PRECISIONS, optional=True, label="format in textures"),
    Option("arithmetic", None, "number format to which the result of each operation is rounded; "
           "default: the value of precision", choices=PRECISIONS, optional=True,
           label="format in kernels"),
    Option("rounding", "nearest", "rounding of fp24 and fp16: to nearest, towards zero, or "
           "towards plus infinity", choices=ROUNDINGS),
    Option("context", None, "OpenGL context: auto, egl, osmesa, angle, native (on Windows and "
           "macOS), or (in Python) an existing context; default: the environment variable "
           "GPGPU_RT_CONTEXT, or auto", object, label="OpenGL context"),
)


def lists(options: Iterable[Option]) -> Callable[[type], type]:
    """Return a decorator that appends a list of the options to the docstring of a class."""
    def decorate(kind: type) -> type:
        entries = [f"{option.name} : {option.values}"
                   + ("" if "default:" in option.help else f"; default {option.default!r}") + "\n"
                   + textwrap.fill(option.help, 90, initial_indent="    ",
                                   subsequent_indent="    ") for option in options]
        text = "\n".join(["Options", "-------", *entries])
        kind.__doc__ = f"{inspect.cleandoc(kind.__doc__ or '')}\n\n{text}\n"
        return kind
    return decorate


def spell(choice: Any) -> str:
    """Return a choice as the command line spells it: (4, 2) is 4x2."""
    return "x".join(map(str, choice)) if isinstance(choice, tuple) else str(choice)


def word_define(prefix: str, word: str) -> str:
    """Return the macro for a word, such as INTERSECTION_MOLLER_TRUMBORE for moller-trumbore."""
    return f"{prefix}_{word.upper().replace('-', '_')}"


def resolve_options(given: Mapping[str, Any], known: Iterable[Option],
                    what: str) -> dict[str, Any]:
    """Return the value of every known option. In messages, ``what`` names the options' owner.

    Raises
    ------
    OptionError
        for an unknown option, an invalid value, or options that exclude each other
    """
    table = {option.name: option for option in known}
    for name in given:
        if name not in table:
            raise OptionError(f"{what} has no option {name!r}" + nearest_names(name, table))
    found = {name: option.check(given[name]) if name in given else option.default
             for name, option in table.items()}
    clash = clashing(found, table.values())
    if clash:
        raise OptionError(f"{what}: {clash}")
    return found


def with_era(given: Mapping[str, Any], known: Iterable[Option], what: str,
             more: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options ``given``, and the options that the option ``era`` implies.

    ``more`` holds the options that the method's era form implies on every chip.

    Raises
    ------
    OptionError
        for another value of an implied option, or for a value with which a search may lose hits.
        Such a search may never end, because the era form has no step limit
    """
    if str(given.get("era")) not in ERAS:
        return dict(given)
    implied = {**ERAS[str(given["era"])], **more}
    for name in ("storage", "arithmetic", *implied):
        value = implied.get(name, implied["precision"])
        if given.get(name) not in (None, value):
            raise OptionError(f"{what}: era={given['era']} implies "
                              + ", ".join(f"{n}={v}" for n, v in implied.items())
                              + f"; leave {name} out")
    for option in known:
        if given.get(option.name) in option.relaxed and option.name not in implied:
            raise OptionError(f"{what}: {option.name}={given[option.name]} may lose hits, and a "
                              "search in the era form would then never end; leave "
                              f"{option.name} or era out")
    return {**given, **implied}


def clashing(values: Mapping[str, Any], known: Iterable[Option]) -> str | None:
    """Return a message about two options that conflict, or None.

    An option that is missing from ``values`` has its default.
    """
    table = {option.name: option for option in known}
    given = {name: values.get(name, option.default) for name, option in table.items()}
    changed = [option for name, option in table.items() if given[name] != option.default]
    for option in changed:
        for other in changed:
            if other.name in option.excludes:
                return (f"{option.name} and {other.name} exclude each other"
                        + _WHY_EXCLUDED.get((option.name, other.name),
                                            "; leave one of them at its default"))
        if option.goes_with and not option.fits(given):
            name, fit = option.goes_with
            return (f"{option.name} needs {name} "
                    f"{' or '.join(spell(value).lower() for value in fit)}; leave "
                    f"{option.name} out with {name} {spell(given[name]).lower()}")
    return None
