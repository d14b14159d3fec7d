"""Choices: a tracer has a choice (a method with options) for coherent and for incoherent rays."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from ..errors import OptionError
from . import Method, find_method

COHERENT, INCOHERENT = "coherent", "incoherent"
RAYS = (COHERENT, INCOHERENT)
# Options that do not change how rays are traced. Settings files do not store these options.
PASSING = ("statistics", "context")


@dataclass(frozen=True)
class Choice:
    """A method with options.

    Attributes
    ----------
    method, options : arguments of `Tracer`
    promise : the error bounds that the user asked for, see `accuracy.error_targets.Promise`;
        empty if the user asked for no bounds
    measured : name -> measurement by `tune`, such as rays_per_second and upper_95 (the upper
        95 % confidence bound of the share of wrong rays)
    """

    method: str
    options: Mapping[str, Any] = field(default_factory=dict)
    promise: dict[str, Any] = field(default_factory=dict)
    measured: dict[str, Any] = field(default_factory=dict)

    def resolved(self) -> tuple[Method, dict[str, Any]]:
        """Return the method's row for these options (`Method.formed`), and every option's value.

        Raises
        ------
        OptionError
            if the method or an option does not exist, or if options exclude each other
        """
        row = find_method(self.method)
        options = row.resolved(self.options)
        return row.formed(options), options


@dataclass(frozen=True)
class Choices:
    """The choices of a tracer for coherent and for incoherent rays."""

    coherent: Choice
    incoherent: Choice

    def __post_init__(self) -> None:
        for one in (self.coherent, self.incoherent):
            if not isinstance(one, Choice):
                raise OptionError(f"a choice must be a Choice, not {one!r}; give, for example, "
                                  'Choice("bvh-packet", {"octants": True})')

    @classmethod
    def one(cls, choice: Choice) -> Choices:
        """Return Choices that use ``choice`` for all rays."""
        return cls(choice, choice)

    def of(self, rays: str) -> Choice:
        """Return the choice for ``rays``, which is "coherent" or "incoherent"."""
        return self.coherent if rays == COHERENT else self.incoherent

    @property
    def differ(self) -> bool:
        """Whether the two choices differ in method or options."""
        one, other = self.coherent, self.incoherent
        return (one.method, one.options) != (other.method, other.options)

    def resolved(self) -> dict[str, tuple[Method, dict[str, Any]]]:
        """Return kind of rays -> the result of `Choice.resolved` for its choice."""
        return {rays: self.of(rays).resolved() for rays in RAYS}

    def with_options(self, options: Mapping[str, Any], where: str) -> Choices:
        """Return these choices with ``options`` added. Only PASSING options may be new.

        Parameters
        ----------
        options : option -> value
        where : where the choices come from, such as "the settings file", for the error message

        Raises
        ------
        OptionError
            if an option outside ``PASSING`` is missing in a choice, or has another value there
        """
        return Choices(*(replace(choice, options=_added(choice.options, options, where))
                         for choice in (self.coherent, self.incoherent)))


def _added(own: Mapping[str, Any], more: Mapping[str, Any], where: str) -> dict[str, Any]:
    for name, value in more.items():
        if name in PASSING or name in own and value == own[name]:
            continue
        said = f"set {name}={own[name]}" if name in own else "fixed all options"
        raise OptionError(f"option {name}={value}: {where} {said}; leave the option out, or name "
                          "a method instead")
    return {**own, **more}
