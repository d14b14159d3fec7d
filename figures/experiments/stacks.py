"""Stacks (survey, section 4.3): the bytes that a ray keeps on the chip, and the rays in flight."""
from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from gpgpu_rt.bench.workloads import EYE
from gpgpu_rt.gl.record import Field
from gpgpu_rt.hardware.machines import machines
from gpgpu_rt.methods import find_method
from gpgpu_rt.rays.records import HIT, RAY_TEXELS
from gpgpu_rt.traversal.records import STACK_ENTRY

from ..framework.cell import Cell
from ..framework.output import markdown_table, number, plt, save_chart, write_csv, write_text
from ..framework.published_numbers import published
from ..framework.results import finished, read
from .gap_work import DONE, STACKS

SCENE, CARD = "kitchen", "G80"
WARP, CLOCKS = 32, 4      # rays of a warp, and clocks that an instruction of a warp takes
MEMORIES = range(512, 128 * 1024 + 1, 512)    # on-chip bytes of a multiprocessor
TICKS = (1, 2, 4, 8, 16, 32, 64, 128)         # KiB
CHANNEL = 4               # bytes of a channel
# The survey's numbers: bytes of stack per ray, and rays that could run at once.
SURVEYS = int(published("text", "", "bvh stack", quantity="local stack per ray") or 0)
AT_ONCE = int(published("text", "", "", quantity="processes in parallel") or 0)


def _bytes(fields: Iterable[Field], names: Iterable[str] | None = None) -> int:
    """Bytes of a record's fields, or only of the named fields, which the record must have."""
    widths = {field.name: CHANNEL * field.width for field in fields}
    return sum(widths.values() if names is None else map(widths.__getitem__, names))


# A BVH's stack stores nodes alone; a kd-tree's stack also stores where the interval ends.
NODE, KD_ENTRY = _bytes(STACK_ENTRY.fields, ["node"]), _bytes(STACK_ENTRY.fields)
LOCAL = ("node", "cursor", "stacked")    # the fields that a packet keeps within a pass
# Label -> method, its options, bytes of a stack entry, and number of entries. None entries means
# that the stack is as deep as the tree requires.
METHODS: dict[str, tuple[str, tuple[tuple[str, Any], ...], int, int | None]] = {
    "kd-restart": ("kd-restart", (), 0, 0),
    "kd-push-down": ("kd-push-down", (), 0, 0),
    "kd-ropes": ("kd-ropes", (), 0, 0),
    "kd-short-stack": ("kd-short-stack", (), KD_ENTRY, 3),
    "kd-stack": ("kd-stack", (), KD_ENTRY, None),
    "bvh-threaded octants": ("bvh-threaded", (("octants", True),), 0, 0),
    "bvh-stack": ("bvh-stack", (), NODE, None)}
# Label -> the method whose states show how deep the stack is.
DEPTHS = {"kd-stack": "kd-texture-stack", "bvh-stack": "bvh-stack"}
COLOURS = {"kd-restart": "#2f6db3", "kd-push-down": "#1b3f73", "kd-ropes": "#b33a3a",
           "kd-short-stack": "#7a4fa3", "kd-stack": "#d16fae", "bvh-threaded octants": "#1d5c37",
           "bvh-stack": "#8cc79d"}
HEADS = ("method", "bytes a ray in registers", "bytes of stack", "deepest seen",
         "instructions a ray", "fetches a ray", "rays to hide fetches", "rays in flight",
         "share of peak", "Mrays/s", "Mrays/s with unlimited memory")


def size(full: bool) -> int:
    """Pixels per side."""
    return 1024 if full else 256


def _cell(label: str, full: bool) -> Cell:
    method, options, _, _ = METHODS[label]
    return Cell(SCENE, method, options, size(full), DONE + EYE, 1)


def _depths(label: str, full: bool) -> Cell:
    return Cell(SCENE, DEPTHS[label], (), 128 if full else 64, STACKS + EYE, 1)


def cells(full: bool) -> list[Cell]:
    return [*(_cell(label, full) for label in METHODS), *(_depths(one, full) for one in DEPTHS)]


class Flight:
    """The number of rays that fit a multiprocessor, and the rate that they reach.

    Parameters
    ----------
    work : the result of a `gap_work` cell of the kind DONE
    kept : bytes of a ray in registers
    stack : bytes of a ray's stack, besides the registers
    """

    def __init__(self, work: dict[str, Any], kept: int, stack: int) -> None:
        self.card, self.kept, self.stack = machines()[CARD], kept, stack
        warps = {region: one["runs"][str(WARP)] * WARP / work["count"]
                 for region, one in enumerate(work["regions"])}
        self.instructions = sum(warps[at] * one["scalar"]
                                for at, one in enumerate(work["regions"]))
        # The texels of a record are fetched at the same time, so they count once.
        self.fetches = sum(warps[at] * sum(name.endswith("_table") for name in one["fetches"])
                           for at, one in enumerate(work["regions"]))

    @property
    def clocks(self) -> float:
        """Clocks that a warp takes for its rays if no other warp runs on the multiprocessor."""
        return CLOCKS * self.instructions + self.card.fetch_latency * self.fetches

    @property
    def needed(self) -> float:
        """The number of rays in flight that is needed to issue an instruction in every clock."""
        return WARP * self.clocks / (CLOCKS * self.instructions)

    def fitting(self, memory: int) -> int:
        """The number of rays whose states fit the registers and whose stacks fit ``memory`` bytes.

        Only whole warps count. The card's limit of resident rays applies as well.
        """
        states = self.card.registers // (self.kept * WARP) * WARP
        stacks = memory // (self.stack * WARP) * WARP if self.stack else states
        return min(states, stacks, self.card.resident)

    def rate(self, memory: int) -> float:
        """Rays per second of the card, with this memory for stacks."""
        return self._rate(self.fitting(memory))

    @property
    def best(self) -> float:
        """Rays per second with unlimited memory for stacks."""
        return self.rate(1 << 40)

    @property
    def peak(self) -> float:
        """Rays per second if no ray waited for a fetch."""
        return self.card.multiprocessors * self.card.clock * WARP / (CLOCKS * self.instructions)

    def _rate(self, rays: float) -> float:
        in_flight = self.card.multiprocessors * rays * self.card.clock / self.clocks
        return min(self.peak, in_flight)


def state_bytes(label: str) -> int:
    """Bytes that a ray carries besides a stack: the ray, its hit, and the method's state.

    Stacks inside the state are left out.
    """
    row = find_method(METHODS[label][0])
    if row.packet_state:
        kept = _bytes(row.packet_state({}).state.fields, LOCAL)
    else:
        kept = _bytes(one for one in row.state.fields if not one.name.startswith("stack_"))
    return _bytes(RAY_TEXELS.fields) + _bytes(HIT.fields) + kept


def flights(data: Path, full: bool) -> dict[str, tuple[Flight, int | None]]:
    """Return for each method its `Flight`, and the deepest stack of a ray (None without stack)."""
    found = {}
    for label, (_, _, entry, entries) in METHODS.items():
        result = read(_cell(label, full), data)
        if result is None:
            continue
        deepest, kept, stack = None, state_bytes(label), 0
        if label in DEPTHS:
            seen = read(_depths(label, full), data)
            if seen is None:
                continue
            stack, deepest = entry * seen["gap"]["levels"], len(seen["gap"]["histogram"]) - 1
        else:     # a few entries fit into registers
            kept += entry * (entries or 0)
        found[label] = Flight(result["gap"], kept, stack), deepest
    return found


def rows(data: Path, full: bool) -> list[list[Any]]:
    """The rows of the table whose columns are HEADS, for the card's own memory."""
    card = machines()[CARD]
    return [[label, one.kept, one.stack, deepest, one.instructions, one.fetches, one.needed,
             one.fitting(card.on_chip), one.rate(card.on_chip) / one.peak,
             1e-6 * one.rate(card.on_chip), 1e-6 * one.best]
            for label, (one, deepest) in flights(data, full).items()]


def draw(data: Path, out: Path, full: bool) -> None:
    """Write out/stacks.csv, .md and .png."""
    found, card = rows(data, full), machines()[CARD]
    if not found:
        return
    _, heading = finished(cells(full), data)[0]
    note = (f"{SCENE}, squares of 32x32 out of {size(full)}x{size(full)} eye rays, emulated in "
            f"warps of {WARP}; {card.name}: {card.multiprocessors} multiprocessors, "
            f"{card.fetch_latency} clocks per fetch, at most {card.resident} rays each. "
            f"{heading['gpu']['renderer']}, commit {heading['commit']}."
            + (f" {SCENE} is a procedural stand-in." if heading["scene"]["stand_in"] else ""))
    write_csv(out / "stacks.csv", HEADS, found)
    write_text(out / "stacks.md", "# Stack against stackless\n\n" + _paragraph(found) + "\n\n"
               + note + "\n\n" + markdown_table(HEADS, [
                   [number(v) if isinstance(v, float) else "-" if v is None else v for v in row]
                   for row in found]))
    figure, axis = plt.subplots(figsize=(10.5, 5.2))
    for label, (one, _) in flights(data, full).items():
        axis.plot([m / 1024 for m in MEMORIES], [1e-6 * one.rate(m) for m in MEMORIES],
                  "-" if one.stack else "--", color=COLOURS[label],
                  label=f"{label}: {one.kept} + {one.stack} bytes a ray")
    axis.axvline(card.on_chip / 1024, color="#555555", linewidth=1, linestyle=":")
    axis.annotate(f"{card.on_chip // 1024} KiB, the card's own", (card.on_chip / 1024, 0),
                  xytext=(4, 8), textcoords="offset points", fontsize=8)
    axis.set_xscale("log", base=2)
    axis.set_xticks(TICKS, map(str, TICKS))
    axis.set(xlabel="KiB of memory for stacks per multiprocessor",
             ylabel="Mrays/s that the card could trace", ylim=(0, None))
    axis.legend(frameon=False, fontsize=8, loc="upper left", bbox_to_anchor=(1, 1),
                title="registers + stack", title_fontsize=8)
    axis.spines[["top", "right"]].set_visible(False)
    figure.suptitle("Rays in flight that fit, and their rate (dashed: without a stack)",
                    fontsize=11)
    figure.tight_layout(rect=(0, 0.07, 1, 1))
    save_chart(figure, out / "stacks.png", note)


def _paragraph(found: list[list[Any]]) -> str:
    """Sentences on what the survey expects, and on what the rows show."""
    card, by = machines()[CARD], {row[0]: row for row in found}
    parts = [
        f"The survey computes that stacks of {SURVEYS} bytes a ray leave "
        f"{card.on_chip // SURVEYS} rays in the {card.on_chip // 1024} KiB of the {CARD}, where "
        f"{AT_ONCE} could run. From this it concludes that stacks gain nothing on this card. But "
        f"each multiprocessor has its own {card.on_chip // 1024} KiB. {card.on_chip // SURVEYS} "
        f"such stacks fit into a multiprocessor of {WARP // CLOCKS} lanes, and "
        f"{card.multiprocessors * card.on_chip // SURVEYS} on the card. There are enough rays for "
        "the lanes, but not always enough to hide the latency of fetches."]
    for label in ("kd-stack", "bvh-stack"):
        if label in by:
            row = by[label]
            parts.append(
                f"{label} keeps a stack of {row[2]} bytes a ray, as deep as the tree requires "
                f"(rays filled {row[3]} entries at most). {row[7]} rays fit, while "
                f"{number(row[6])} would be needed to hide fetches, and {number(100 * row[8])} % "
                "of the peak rate remains.")
    if {"kd-restart", "kd-short-stack", "kd-stack"} <= by.keys():
        most = max(found, key=lambda row: row[9])
        parts.append(
            f"kd-restart fits {by['kd-restart'][7]} rays into registers and reaches "
            f"{number(by['kd-restart'][9])} Mrays/s, kd-stack {number(by['kd-stack'][9])} and "
            f"kd-short-stack {number(by['kd-short-stack'][9])}. With unlimited memory they reach "
            f"{number(by['kd-restart'][10])}, {number(by['kd-stack'][10])} and "
            f"{number(by['kd-short-stack'][10])}. {most[0]} is the fastest method. With the "
            "card's memory, the survey's claim "
            + ("holds" if by["kd-stack"][9] < by["kd-restart"][9] else "does not hold")
            + " for kd-stack against kd-restart. What decides is whether fetches are hidden, and "
            "not, as the survey says, the number of rays for the lanes.")
    return " ".join(parts)
