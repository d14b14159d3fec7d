"""Prediction: predicts the time that a card of 2002-2006 would have taken to trace rays.

Figures, ``render --era`` and users call this module, so all three use the same model. Their times
may differ for equal rays, because ``render --era`` traces smaller samples.
"""
from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ..bench.workloads import RAY_SETS, Workload, rays_of, told
from ..errors import OptionError, nearest_names
from ..methods import built_in_methods, find_method
from ..scene.scene import Scene
from .cards import Card, Needs, Refusal, find_card
from .image_issues import measure
from .issue import KernelIssues
from .loop_costs import setup_slots
from .machine_model import (
    ASSUMED, Assumptions, CardTime, stream_fetches, time_of_loop, time_of_passes
)
from .methods_on_cards import ERA, EraSize, era_refusals
from .program_forms import (
    FORMS, PACKETS, PASSES, SAME_WALK, SINGLE_RAYS, UNCOALESCED, WARPS, counted_as, forms_of,
    kernels_from, packets_in_loop
)
from .static_costs import StaticCost, era_methods, packet_methods, static_cost
from .warp_packets import LANES

Options = tuple[tuple[str, Any], ...]

# The default rays: their kind, and the side of their square image in pixels.
KIND, SIDE = "eye", 512


@dataclass(frozen=True)
class Prediction:
    """The time that a card would have taken to trace the rays of an image, without shading.

    Attributes
    ----------
    card : the card
    method : the method's name
    form : the form of the card's program, a key of `program_forms.MEANINGS`
    rays : the kind of the rays, in words
    count : the number of pixels of the image that have a ray
    size : pixels per side of the image
    time : the time and its parts
    """

    card: Card
    method: str
    form: str
    rays: str
    count: int
    size: int
    time: CardTime

    @property
    def seconds(self) -> float:
        """The predicted time of all rays, in seconds."""
        return self.time.seconds

    @property
    def parts(self) -> dict[str, float]:
        """Name -> seconds of each part that takes time, such as "waiting lanes"."""
        return self.time.spent

    @property
    def nanoseconds(self) -> float:
        """The predicted nanoseconds per ray."""
        return 1e9 * self.seconds / max(self.count, 1)

    def __str__(self) -> str:
        return (f"{self.method} on {self.card.name}, form {self.form}: {self.nanoseconds:,.0f} ns "
                f"per ray for {self.count:,} {self.rays} of {self.size}x{self.size} pixels "
                f"({self.time.shares})")


def predict(scene: Scene, method: str, card: str, rays: str | Workload = KIND, size: int = SIDE,
            form: str | None = None, **options: Any) -> Prediction:
    """Predict the time that a card would have taken to trace the rays of an image.

    The rays are not all traced: their work is estimated from at most 128x128 pixels and four tiles
    of 96x96 pixels (of 128x128 for kd-packet on NV40). Packets on the G80 are all traced. The time
    depends on ``size``, because neighbouring rays of a larger image need the same kernels more
    often. The sizes of tables are not compared with the card's limits.

    Parameters
    ----------
    scene : Scene
    method : a method with an era form (docs/era.md); or, on the G80, kd-stack or a packet method
    card : a chip, such as "nv40" or "g80", or a card's name; `FORMS` has the chips
    rays : ``"eye"`` or another kind of rays, as in ``gpgpu-rt bench --rays``, or an image's rays
    size : pixels per side of the image; a `Workload` has its own size
    form : the form of the card's program (`forms_of`). None is the form that the figures compare
        with the papers' times
    options : options of the method

    Raises
    ------
    OptionError
        for an unknown name, a method that the card could not have run, or options with which the
        kernels were not compiled for the card
    """
    if not isinstance(scene, Scene):
        raise OptionError(f"scene is a {type(scene).__name__}; give a Scene, such as "
                          'rt.load_scene("cornell")')
    found, row = find_card(card), find_method(method)
    for name in options:
        if name not in (known := [option.name for option in row.options]):
            raise OptionError(f"predict accepts only options of the method itself, and {method} "
                              f"has no option {name!r}" + (nearest_names(name, known) if known
                                                           else "; leave it out"))
    form = checked_form(found, method, form)
    if isinstance(rays, str):
        if rays not in RAY_SETS:
            raise OptionError(f"no rays {rays!r}{nearest_names(rays, RAY_SETS)}")
        kind, rays = RAY_SETS[rays], rays_of(scene, RAY_SETS[rays], size)
    elif isinstance(rays, Workload):
        kind = "any-hit rays" if rays.any_hit else "nearest-hit rays"
    else:
        raise OptionError(f"rays is {rays!r}; give a Workload or one of {', '.join(RAY_SETS)}")
    if packets_in_loop(method, found.chip) and row.era_packets is not None:
        implied = row.era_packets.implied(row.options)
        options = {**{o.name: implied[o.name] for o in row.options if o.name in implied},
                   **options}
        row.era_packets.check(method, options)
    counts = measure(scene, rays, method, options, found.chip)
    time = time_of_image(found, method, form, counts, rays.any_hit,
                         options=tuple(options.items()))
    return Prediction(found, method, form, told(kind), rays.live, rays.size, time)


def checked_form(card: Card, method: str, form: str | None = None) -> str:
    """Return the form in which the card runs the method; None means the card's usual form.

    Raises
    ------
    OptionError
        if no form is known, or the card could not have run the method
    """
    check_predicted(card)
    if limit := limit_of(card, method):
        raise OptionError(f"the {card.name} could not have run method {method}, which "
                          f"{limit.says}; give another card")
    forms = forms_of(method, card.chip)
    if not forms:
        advice = ("give another card" if method in era_methods() else
                  "`gpgpu-rt methods` says which methods have an era form")
        raise OptionError(f"no time of {method} is predicted for the {card.name}: "
                          f"{why_no_time(method)}; {advice}")
    if form is not None and form not in forms:
        raise OptionError(f"method {method} has no form {form!r} on the {card.name}"
                          + nearest_names(repr(form), map(repr, forms)))
    return form or forms[0]


def check_predicted(card: Card) -> None:
    """Raise OptionError for a card without predicted times."""
    if card.chip not in FORMS:
        raise OptionError(f"no times are predicted for the {card.name}; give a card of "
                          + ", ".join(FORMS))


def limit_of(card: Card, method: str) -> Refusal | None:
    """Return the first limit of the card that forbids the method. Return None if the card can run
    the method's kernels, or if no card's compiler compiled these kernels. The sizes of tables are
    not compared."""
    if method in SAME_WALK:     # a stack in a local array, which does not last from pass to pass
        return next(iter(card.refuses(Needs(loops=True, arrays=True))), None)
    if method not in era_methods() and method not in packet_methods():
        return None
    return next(iter(era_refusals(card, {method: EraSize()})[method, ERA]), None)


def why_no_time(method: str) -> str:
    """Return why cards have no form of the method, and how a G80 still runs a packet method."""
    row = find_method(method)
    if row not in built_in_methods():
        return "no costs were compiled for a method of your own"
    if row.steps_once and method in era_methods():
        return ("each push and each pop needs a pass of its own, and the model has no form with "
                f"passes on the {WARPS}")
    single = SINGLE_RAYS.get(method)
    return row.why_no_era_form() + (
        f"; on the {WARPS}, each lane of a warp runs the kernels of {single} for a ray of a packet"
        if single else "")


def time_of_image(card: Card, method: str, form: str, counts: Mapping[str, Any], any_hit: bool,
                  assumed: Assumptions = ASSUMED, options: Options = ()) -> CardTime:
    """Return the predicted time of an image's rays.

    Parameters
    ----------
    card : the card
    method : the method's name
    form : the form of the programs
    counts : a result of `image_issues.measure`
    any_hit : whether any hit is enough
    assumed : the numbers of the model without a source
    options : pairs (name, value); options that the compiled method lacks are ignored
    """
    found = {name: tuple(value) if isinstance(value, list) else value
             for name, value in counts["issued"][counted_as(form)].items()}
    issued = KernelIssues(**found)
    costs, streams = compiled(card, method, form, issued.kernels, any_hit, options)
    if form == PASSES:
        return time_of_passes(card, issued, costs, streams, counts["pixels"], assumed)
    # A warp loads a packet's node or triangle once, into memory that its lanes share (Günther et
    # al. 2007; section 4.1 of the survey).
    sharing = LANES if form == PACKETS else 1
    setup = setup_slots(card.chip.lower(), kernels_from(method, form), any_hit,
                        **_own(method, form, options))
    return time_of_loop(card, issued, costs, streams, counts["pixels"], assumed, sharing,
                        form == UNCOALESCED, setup)


def compiled(card: Card, method: str, form: str, kernels: tuple[str, ...], any_hit: bool,
             options: Options) -> tuple[dict[str, StaticCost], dict[str, int]]:
    """Return each kernel's static cost, and each kernel's number of fetches from streams.

    The parameters are those of `time_of_image`; ``kernels`` has the names of the kernels.
    """
    return _compiled(card.chip.lower(), kernels_from(method, form), kernels, any_hit,
                     form != PASSES, tuple(_own(method, form, options).items()))


@functools.cache
def _compiled(chip: str, method: str, kernels: tuple[str, ...], any_hit: bool,
              in_loop: bool, options: Options) -> tuple[dict[str, StaticCost], dict[str, int]]:
    own = dict(options)
    return ({name: static_cost(chip, method, name, any_hit, in_loop, **own) for name in kernels},
            {name: stream_fetches(method, name, any_hit, in_loop, chip, **own)
             for name in kernels})


def _own(method: str, form: str, options: Options) -> dict[str, Any]:
    """Return those of ``options`` that the method named by `kernels_from` has."""
    known = {option.name for option in find_method(kernels_from(method, form)).options}
    return {name: value for name, value in options if name in known}
