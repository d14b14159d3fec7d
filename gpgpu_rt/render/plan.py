"""Plan: lists the passes, textures and defines of a picture, and says why others are omitted."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from ..text_format import counted
from .integrator import Integrator
from .needs import PROPERTIES, SceneNeeds, every_define


@dataclass(frozen=True)
class Plan:
    """The passes, textures and defines of a picture.

    Attributes
    ----------
    integrator : the integrator's name
    needs : bounces after which a ray may still change the picture, shadow rays per hit, bits of a
        triangle index, and the formats of stored and computed numbers
    present : properties that the scene has, or that options request
    passes : names of the passes, in the order of their declaration
    textures : name of a texture or stream -> its bytes
    defines : the defines of the programs
    left_out : kind ("pass", "texture" or "define") -> name -> the reason, such as a property that
        the scene lacks
    """

    integrator: str
    needs: Mapping[str, Any]
    present: tuple[str, ...]
    passes: tuple[str, ...]
    textures: Mapping[str, int]
    defines: tuple[str, ...]
    left_out: Mapping[str, Mapping[str, str]]

    @classmethod
    def of(cls, drawer: Integrator, of_tracer: Mapping[str, int]) -> Plan:
        """Return the plan of an integrator whose streams are allocated. ``of_tracer`` maps the
        tracer's other textures to their bytes."""
        needs, asked = drawer.planned, drawer.needs.asked
        unused = set(drawer.needs.defines) - set(needs.defines)
        streams, passes = drawer.streams(), drawer.passes
        own = drawer.bytes()
        tables = {t.record.name: t for p in PROPERTIES for t in p.tables}
        images = [image for p in PROPERTIES for image in p.images]
        absent = {
            "pass": {p.name: _why(needs, p.wanted) for p in passes if not needs.want(p.wanted)},
            "texture": {
                **{name: needs.why_not(table=name) for name in tables if name not in own},
                **{name: needs.why_not(image=name) for name in images if name not in own},
                **{s.name: _why(needs, s.wanted) for s in streams if not needs.want(s.wanted)}},
            "define": {d: needs.why_not(define=d) for d in every_define()
                       if d not in needs.defines}}
        values = {"bounces": needs.bounces, "lights": needs.lights,
                  "index_bits": needs.index_bits, "storage": asked.precision.storage,
                  "arithmetic": asked.precision.arithmetic}
        return cls(drawer.name, values, needs.present,
                   ("eye rays", *(p.name for p in passes if needs.want(p.wanted))),
                   {**of_tracer, **own},
                   tuple(define for define, on in drawer.defines.items()
                         if on and define not in unused), absent)

    def to_dict(self) -> dict[str, Any]:
        return {**asdict(self), "texture_bytes": sum(self.textures.values())}

    def lines(self) -> list[str]:
        """Return the plan as lines of text."""
        n = self.needs
        requested = {p.name for p in PROPERTIES if p.of_request}
        said = {of_request: [name for name in self.present if (name in requested) == of_request]
                for of_request in (False, True)}
        lines = [f"integrator {self.integrator}: {n['bounces']} bounces can matter, "
                 f"{counted(n['lights'], 'shadow ray')} per hit, "
                 f"indices of {n['index_bits']} bits, "
                 f"{n['storage']} stored, {n['arithmetic']} computed",
                 "the scene has: " + (", ".join(said[False]) or "no property that needs support"),
                 *(["asked for: " + ", ".join(said[True])] if said[True] else []),
                 "passes: eye rays, traversal, " + ", ".join(self.passes[1:]),
                 "defines: " + (" ".join(self.defines) or "none"), "textures:"]
        lines += [f"  {size / 2**20:9.3f} MiB  {name}" for name, size in self.textures.items()]
        lines.append(f"  {sum(self.textures.values()) / 2**20:9.3f} MiB  together")
        by_reason: dict[str, list[str]] = {}
        for kind, names in self.left_out.items():
            for name, reason in names.items():
                by_reason.setdefault(reason, []).append(f"{kind} {name}")
        lines.append("left out, by reason:")
        lines += [f"  {reason}: {', '.join(names)}" for reason, names in by_reason.items()]
        return lines


def _why(needs: SceneNeeds, wanted: tuple[str, ...]) -> str:
    return " and ".join(dict.fromkeys(needs.why_not(define=define) for define in wanted))
