"""Writes tables of options, from the options' declarations."""
from __future__ import annotations

from collections.abc import Iterable

from gpgpu_rt.cli.help import Variants, described
from gpgpu_rt.cli.picture import light_options
from gpgpu_rt.cli.shared import all_options
from gpgpu_rt.options import TRACER_OPTIONS, Option

from .markdown import code, plain, table
from .method_pages import default_of


def options_text() -> str:
    of_methods = {name: kinds for name, kinds in all_options().items()
                  if not any("the tracer" in owners for owners in kinds.values())}
    return ("## Options of every method\n\n" + table(
        ("option", "default", "meaning", "limits"),
        [(code(one.name), default_of(one), plain(described(one)), _limits(one))
         for one in TRACER_OPTIONS])
        + "\n## Options of some methods\n\n" + _owned(of_methods, "methods")
        + "\n## Options of pictures\n\n" + _owned(light_options(), "integrators"))


def _owned(options: Variants, owner: str) -> str:
    rows = [(code(one.name), ", ".join(owners), default_of(one), plain(described(one)),
             _limits(one)) for kinds in options.values() for one, owners in kinds.items()]
    return table(("option", owner, "default", "meaning", "limits"), rows)


def _limits(option: Option) -> str:
    """Returns an option's limits: bounds, needed schedules and options, excluded options, and
    values that may lose hits."""
    found = []
    if option.minimum is not None:
        found.append(f"at least {option.minimum:g}")
    if option.maximum is not None:
        found.append(f"at most {option.maximum:g}")
    if option.schedules:
        found.append(f"schedules {_words(option.schedules)}")
    if option.excludes:
        found.append(f"not with {_words(option.excludes)}")
    if option.goes_with is not None:
        name, values = option.goes_with
        found.append(f"with {code(name)} {_words(values)}")
    if option.relaxed:
        found.append(f"{_words(option.relaxed)} may lose hits")
    return "; ".join(found)


def _words(values: Iterable[object]) -> str:
    return ", ".join(code(str(value)) for value in values)
