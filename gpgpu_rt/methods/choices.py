"""Choices: a method with options for coherent rays, and one for rays that are not."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from ..errors import OptionError
from . import Method, find_method

COHERENT, INCOHERENT = "coherent", "incoherent"
RAYS = (COHERENT, INCOHERENT)
# Options that say how a call is watched, not how it is traced; settings do not hold them.
PASSING = ("statistics", "context")


@dataclass(frozen=True)
class Choice:
    """A method with options.

    Attributes
    ----------
    method, options : as `Tracer` takes them
    promise : the bounds that were asked for, see `promise.Promise`; empty where none were
    measured : what was found: rays, wrong, upper_95, t_error, rays_per_second, bytes, ...
    """

    method: str
    options: Mapping[str, Any] = field(default_factory=dict)
    promise: dict[str, Any] = field(default_factory=dict)
    measured: dict[str, Any] = field(default_factory=dict)

    def resolved(self) -> tuple[Method, dict[str, Any]]:
        """The row in the form that the options give it, and every option with its value.

        Raises
        ------
        OptionError
            a method or an option that there is not, or options that do not go together
        """
        row = find_method(self.method)
        options = row.resolved(self.options)
        return row.formed(options), options


@dataclass(frozen=True)
class Choices:
    """What a tracer takes for coherent rays, and what for others."""

    coherent: Choice
    incoherent: Choice

    def __post_init__(self) -> None:
        for one in (self.coherent, self.incoherent):
            if not isinstance(one, Choice):
                raise OptionError(f"choices are of Choice, not {one!r}; give "
                                  'Choice("bvh-packet", {"octants": True}), say')

    @classmethod
    def one(cls, choice: Choice) -> Choices:
        """One ``choice`` that serves all rays."""
        return cls(choice, choice)

    def of(self, rays: str) -> Choice:
        """The choice for ``rays``, "coherent" or "incoherent"."""
        return self.coherent if rays == COHERENT else self.incoherent

    @property
    def differ(self) -> bool:
        """Whether there are two."""
        one, other = self.coherent, self.incoherent
        return (one.method, one.options) != (other.method, other.options)

    def resolved(self) -> dict[str, tuple[Method, dict[str, Any]]]:
        """Kind of rays -> row of the method table and every option with its value."""
        return {rays: self.of(rays).resolved() for rays in RAYS}

    def with_options(self, options: Mapping[str, Any], where: str) -> Choices:
        """The same with the caller's options added.

        Parameters
        ----------
        options : of ``PASSING``; any other is refused, unless it asks for what both choices say
        where : what messages call the choices

        Raises
        ------
        OptionError
        """
        return Choices(*(replace(choice, options=_added(choice.options, options, where))
                         for choice in (self.coherent, self.incoherent)))


def _added(own: Mapping[str, Any], more: Mapping[str, Any], where: str) -> dict[str, Any]:
    for name, value in more.items():
        if name in PASSING or name in own and value == own[name]:
            continue
        said = f"say {name}={own[name]}" if name in own else "decide that"
        raise OptionError(f"option {name}={value}: {where} {said}; leave it out, or go "
                          "without the settings")
    return {**own, **more}
