"""Stacks (survey, section 4.3): counts the on-chip bytes of a ray, and the rays in flight."""
from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gpgpu_rt.bench.workloads import EYE
from gpgpu_rt.charts import COLOURS, log_axis
from gpgpu_rt.gl.record import Field
from gpgpu_rt.hardware.loop_costs import LoopCost, loop_costs
from gpgpu_rt.hardware.machines import machines
from gpgpu_rt.methods import find_method
from gpgpu_rt.rays.records import HIT, RAY_TEXELS
from gpgpu_rt.traversal.records import STACK_ENTRY

from ..framework.cell import PERIOD_TEST, Cell
from ..framework.output import markdown_table, number, plt, save_chart, write_csv, write_text
from ..framework.published_numbers import published
from ..framework.results import finished, read
from .gap_work import COMPILED, DONE, SIDE, STACKS

SCENE, CARD = "kitchen", "G80"
WARP, CLOCKS = 32, 4      # rays in a warp; clocks per instruction of a warp
MEMORIES = range(512, 128 * 1024 + 1, 512)    # on-chip bytes of a multiprocessor
CHANNEL = 4               # bytes
INVERSE = 3 * CHANNEL     # bytes of 1 / direction, which a program keeps during its loop
# The survey's number of stack bytes a ray.
SURVEYS = int(published("text", "", "bvh stack", quantity="local stack per ray") or 0)


def _bytes(fields: Iterable[Field], names: Iterable[str] | None = None) -> int:
    """Bytes of a record's fields, or of those fields that ``names`` lists."""
    widths = {field.name: CHANNEL * field.width for field in fields}
    return sum(widths.values() if names is None else map(widths.__getitem__, names))


# A BVH's stack stores only nodes; a kd-tree's stack also stores t_max.
NODE, KD_ENTRY = _bytes(STACK_ENTRY.fields, ["node"]), _bytes(STACK_ENTRY.fields)
# The fields of a packet's state that `state_bytes` counts. The other fields keep data between
# passes, and a program with a loop has a single pass.
LOCAL = ("node", "cursor", "stacked")
# Label -> method, options, bytes of a stack entry, and number of entries (None: as many as the
# tree requires).
METHODS: dict[str, tuple[str, tuple[tuple[str, Any], ...], int, int | None]] = {
    "kd-restart": ("kd-restart", (), 0, 0),
    "kd-push-down": ("kd-push-down", (), 0, 0),
    "kd-ropes": ("kd-ropes", (), 0, 0),
    "kd-short-stack": ("kd-short-stack", (), KD_ENTRY, 3),
    "kd-stack": ("kd-stack", (), KD_ENTRY, None),
    "bvh-threaded octants": ("bvh-threaded", (("octants", True),), 0, 0),
    "bvh-stack": ("bvh-stack", (), NODE, None)}
# Label -> the method that is compiled and traced instead of the method in METHODS.
# kd-texture-stack visits the same nodes as kd-stack, but its stack lies in textures.
KERNELS = {"kd-stack": "kd-texture-stack"}
# Label -> the method whose states show how deep the stack is.
DEPTHS = {"kd-stack": "kd-texture-stack", "bvh-stack": "bvh-stack"}
HEADS = ("method", "bytes a ray in registers", "bytes of stack", "deepest seen",
         "instructions a ray", "fetches a ray", "rays to hide fetches", "rays in flight",
         "share of peak", "Mrays/s", "Mrays/s with unlimited memory")


def size(full: bool) -> int:
    """Pixels per side."""
    return 1024 if full else 256


def compiled(label: str) -> str:
    """The method whose kernels are compiled for a label."""
    return KERNELS.get(label, METHODS[label][0])


def missing_kernels() -> dict[str, str]:
    """Label -> why no kernels of the method are compiled."""
    reasons = {label: find_method(compiled(label)).why_no_era_form() for label in METHODS}
    return {label: reason for label, reason in reasons.items() if reason}


def _cell(label: str, full: bool) -> Cell:
    return Cell(SCENE, compiled(label), (*METHODS[label][1], PERIOD_TEST), size(full), DONE + EYE,
                1)


def _depths(label: str, full: bool) -> Cell:
    return Cell(SCENE, DEPTHS[label], (), 128 if full else 64, STACKS + EYE, 1)


def cells(full: bool) -> list[Cell]:
    return [*(_cell(label, full) for label in METHODS if label not in missing_kernels()),
            *(_depths(one, full) for one in DEPTHS)]


@dataclass(frozen=True)
class WarpWork:
    """The work of a ray, including the idle lanes of its warp.

    Attributes
    ----------
    instructions : instructions of kernels
    fetches : fetches of table texels
    levels : the longest chain of dependent fetches in a run of a kernel (`LoopCost.levels`),
        summed over all runs
    """

    instructions: float
    fetches: float
    levels: float

    @classmethod
    def of(cls, gap: Mapping[str, Any], costs: Mapping[str, LoopCost]) -> WarpWork:
        """Return the work of a ray.

        Parameters
        ----------
        gap : a result of gap_work.py (work DONE): the number of lanes that run each kernel
        costs : kernel -> the cost of a run
        """
        def a_ray(field: str) -> float:
            return sum(lanes * getattr(costs[kernel], field)
                       for kernel, lanes in gap["lanes"][str(WARP)].items()) / gap["count"]
        return cls(a_ray("instructions"), a_ray("fetches"), a_ray("levels"))


@dataclass(frozen=True)
class OnChip:
    """The bytes that a ray keeps on the chip: in registers, and in its stack."""

    registers: int
    stack: int

    def fitting(self, memory: int) -> int:
        """Return how many rays fit on a multiprocessor, in whole warps.

        The rays' states must fit into the registers, and their stacks into ``memory`` bytes. The
        number of rays is at most the card's limit of resident rays.
        """
        card = machines()[CARD]
        states = card.registers // (self.registers * WARP) * WARP
        stacks = memory // (self.stack * WARP) * WARP if self.stack else states
        return min(states, stacks, card.resident)


@dataclass(frozen=True)
class Flight:
    """The rays in flight on the card, and the card's rate."""

    kept: OnChip
    work: WarpWork

    @property
    def clocks(self) -> float:
        """Clocks that a warp takes for its rays if no other warp runs on the multiprocessor."""
        return (CLOCKS * self.work.instructions
                + machines()[CARD].fetch_latency * self.work.levels)

    @property
    def needed(self) -> float:
        """The number of rays in flight that keeps a multiprocessor's lanes busy."""
        return WARP * self.clocks / (CLOCKS * self.work.instructions)

    def rate(self, memory: int) -> float:
        """Rays per second, with ``memory`` bytes for stacks per multiprocessor."""
        card = machines()[CARD]
        return min(self.peak, card.multiprocessors * self.kept.fitting(memory) * card.clock
                   / self.clocks)

    @property
    def best(self) -> float:
        """Rays per second with unlimited memory for stacks."""
        return self.rate(1 << 40)

    @property
    def peak(self) -> float:
        """Rays per second if no ray waited for a fetch."""
        card = machines()[CARD]
        return card.multiprocessors * card.clock * WARP / (CLOCKS * self.work.instructions)


def state_bytes(label: str) -> int:
    """Bytes that a ray carries besides its stack: ray, inverse direction, hit and state.

    Stacks inside the state are left out.
    """
    row = find_method(METHODS[label][0])
    if row.packet_state:
        kept = _bytes(row.packet_state({}).state.fields, LOCAL)
    else:
        kept = _bytes(one for one in row.state.fields if not one.name.startswith("stack_"))
    return _bytes(RAY_TEXELS.fields) + INVERSE + _bytes(HIT.fields) + kept


def kept(data: Path, full: bool) -> dict[str, tuple[OnChip, int | None]]:
    """Return for each label a ray's bytes, and the deepest stack (None if not in DEPTHS)."""
    found: dict[str, tuple[OnChip, int | None]] = {}
    for label, (_, _, entry, entries) in METHODS.items():
        if label not in DEPTHS:     # no stack, or a short stack, whose entries fit into registers
            found[label] = OnChip(state_bytes(label) + entry * (entries or 0), 0), None
        elif seen := read(_depths(label, full), data):
            found[label] = (OnChip(state_bytes(label), entry * seen["gap"]["levels"]),
                            len(seen["gap"]["histogram"]) - 1)
    return found


def flights(data: Path, full: bool) -> dict[str, Flight]:
    """Return the `Flight` of each method with compiled kernels and measured work."""
    found = {}
    for label, (one, _) in kept(data, full).items():
        if label in missing_kernels() or not (result := read(_cell(label, full), data)):
            continue
        costs = loop_costs(CARD.lower(), compiled(label), **dict(METHODS[label][1]))
        found[label] = Flight(one, WarpWork.of(result["gap"], costs))
    return found


def rows(data: Path, full: bool) -> list[list[Any]]:
    """Return the table's rows (columns HEADS) for the on-chip memory that the card has."""
    card, flying, found = machines()[CARD], flights(data, full), []
    for label, (one, deepest) in kept(data, full).items():
        numbers: list[Any] = [one.registers, one.stack, deepest, *[None] * 3,
                              one.fitting(card.on_chip), *[None] * 3]
        if label in flying:
            flight = flying[label]
            rate = flight.rate(card.on_chip)
            numbers[3:6] = flight.work.instructions, flight.work.fetches, flight.needed
            numbers[7:] = rate / flight.peak, 1e-6 * rate, 1e-6 * flight.best
        elif label not in missing_kernels():
            continue
        found.append([label, *numbers])
    return found


def draw(data: Path, out: Path, full: bool) -> None:
    measured = finished(cells(full), data)
    if not measured:
        return
    found, heading, card = rows(data, full), measured[0][1], machines()[CARD]
    note = (f"{SCENE}, sample squares of {SIDE}x{SIDE} from {size(full)}x{size(full)} eye rays, "
            f"in warps of {WARP}; kernels compiled by Mesa for the {CARD}. The GeForce 8800 GTX "
            f"has {card.multiprocessors} multiprocessors, {card.fetch_latency} "
            f"clocks per fetch, and at most {card.resident} rays per multiprocessor. "
            f"{heading['gpu']['renderer']}, commit {heading['commit']}."
            + (f" {SCENE} is a procedural stand-in." if heading["scene"]["stand_in"] else ""))
    notes = [f"* {label} has no instructions, fetches and rates: no kernels of "
             f"{compiled(label)} are compiled for the {CARD}, because {reason}."
             for label, reason in missing_kernels().items()]
    notes += [f"* {label} runs the kernels of {other} and visits the same nodes. The stack of "
              f"{other} lies in textures. The stack of {label} lies in on-chip memory, so its "
              "pushes and pops fetch no texels." for label, other in KERNELS.items()]
    write_csv(out / "stacks.csv", HEADS, found)
    write_text(out / "stacks.md", "# Stack against stackless\n\n" + _paragraph(found) + "\n\n"
               + note + "\n\nInstructions and fetches include the idle lanes of a warp. The "
               "texels of a record are fetched at the same time, so a warp waits for them once. "
               + COMPILED + "\n\n"
               + markdown_table(HEADS, [
                   [number(v) if isinstance(v, float) else "-" if v is None else v for v in row]
                   for row in found]) + "\n" + "\n".join(notes) + "\n")
    figure, axis = plt.subplots(figsize=(10.5, 5.2))
    for (label, one), colour in zip(flights(data, full).items(), COLOURS):
        axis.plot([m / 1024 for m in MEMORIES], [1e-6 * one.rate(m) for m in MEMORIES],
                  "-" if one.kept.stack else "--", color=colour,
                  label=f"{label}: {one.kept.registers} + {one.kept.stack} bytes a ray")
    axis.axvline(card.on_chip / 1024, color="#555555", linewidth=1, linestyle=":")
    axis.annotate(f"{card.on_chip // 1024} KiB, the card's own", (card.on_chip / 1024, 0),
                  xytext=(4, 8), textcoords="offset points", fontsize=8)
    log_axis(axis, "x", base=2)
    axis.set(xlabel="KiB of memory for stacks per multiprocessor (log)",
             ylabel="Mrays/s that the card could trace", ylim=(0, None))
    axis.legend(frameon=False, fontsize=8, loc="upper left", bbox_to_anchor=(1, 1),
                title="registers + stack (dashed: no stack)", title_fontsize=8)
    axis.spines[["top", "right"]].set_visible(False)
    figure.tight_layout(rect=(0, 0.07, 1, 1))
    save_chart(figure, out / "stacks.png", note, "Lines show the rate at which the card could "
               "trace rays with each method, against the memory for stacks per multiprocessor")


def _holds(claim: bool) -> str:
    return "holds" if claim else "does not hold"


def _right(faster: bool) -> str:
    return "right" if faster else "wrong"


def _rate(row: list[Any], share: float) -> float:
    """A table row's Mrays/s if the kernels had only a ``share`` of their instructions."""
    card = machines()[CARD]
    peak = 1e-6 * card.multiprocessors * card.clock * WARP / (CLOCKS * share * row[4])
    needed = WARP + (row[6] - WARP) / share
    return float(peak * min(1.0, row[7] / needed))


def _paragraph(found: list[list[Any]]) -> str:
    """Say whether it was right to avoid the stack, and whether the survey's claim holds."""
    card, by = machines()[CARD], {row[0]: row for row in found}
    survey = ("The survey claims that stacks gain nothing on this card, because "
              f"{card.on_chip // 1024} KiB hold the stacks of only {card.on_chip // SURVEYS} "
              f"rays, at {SURVEYS} bytes a ray. But each of the {card.multiprocessors} "
              f"multiprocessors has its own {card.on_chip // 1024} KiB.")
    if not {"kd-restart", "kd-ropes", "kd-stack"} <= by.keys():
        return survey
    restart, ropes, stack = by["kd-restart"], by["kd-ropes"], by["kd-stack"]
    best = max((row for row in found if row[9] is not None), key=lambda row: row[9])
    return (
        f"By the predicted rates on the {CARD}, it was {_right(restart[9] > stack[9])} to avoid "
        f"the stack by restarts, and {_right(ropes[9] > stack[9])} to avoid it by ropes: "
        f"kd-restart traces {number(restart[9] / stack[9])} times as many rays per second as "
        f"kd-stack, and kd-ropes {number(ropes[9] / stack[9])} times as many.\n\n"
        f"{survey} {stack[7]} rays of kd-stack fit on a multiprocessor, and {number(stack[6])} "
        "are needed to hide the latency of fetches. By the table's rates, the survey's claim "
        f"{_holds(stack[9] < restart[9])} for kd-stack against kd-restart. "
        + ("The reason is that too few rays fit to hide the latency of kd-stack's fetches."
           if stack[9] < restart[9] <= stack[10]
           else "More memory for stacks would not change this order.")
        + " With half of the compiled instructions the claim "
        f"{_holds(_rate(stack, 0.5) < _rate(restart, 0.5))}, and with a quarter it "
        f"{_holds(_rate(stack, 0.25) < _rate(restart, 0.25))}. {best[0]} is the fastest of the "
        "methods with a rate.")
