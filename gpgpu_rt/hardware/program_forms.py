"""Program forms: the forms in which a card can run a method's kernels.

A form says how a card's program arranges the kernels, for example as branches in a loop. The
machine model needs a form to predict a time.
"""
from __future__ import annotations

from ..methods import find_method
from .cards import find_card
from .issue import GROUPS, ORDERS, STEP, WHILE_WHILE
from .static_costs import era_methods, packet_methods

PASSES, PACKETS = "passes", "packets"
# The form WHILE_WHILE (issue.py) on the G80, but each lane loads its own data.
UNCOALESCED = "while-while, uncoalesced"
# The form STEP on NV40, but about 256 pixels branch together, as on the 7800 GTX, the next card of
# the family (AnandTech's G80 article, p. 7). On NV40, more than four registers slow a program down
# (GPU Gems 2, chapter 30), probably because fewer pixels are in flight. Then fewer pixels may also
# branch together. No source says how many; this form assumes 256.
SMALLER = "step, 256 pixels"
SMALLER_GROUPS = {"NV40": (16, 16)}
# Chip -> the forms of its programs. The first form is the card's usual form: the figures compare
# its times with the papers' times. R300 and R420 have no loops. The papers that measured on the
# other cards used loops, but most of these papers do not state the order of the kernels.
FORMS: dict[str, tuple[str, ...]] = {
    "R300": (PASSES,), "R420": (PASSES,),
    "NV40": (STEP, SMALLER, WHILE_WHILE, PASSES), "R580": (WHILE_WHILE, STEP, PASSES),
    "G80": (WHILE_WHILE, STEP, UNCOALESCED)}
MEANINGS = {
    PASSES: "one kernel per pass",
    STEP: "a loop; an iteration runs one step of each ray",
    SMALLER: "a loop; an iteration runs one step of each ray; 256 pixels branch together",
    WHILE_WHILE: "a loop with an inner loop for each kernel",
    UNCOALESCED: "a loop with an inner loop for each kernel; each lane loads its own data",
    PACKETS: "the rays of a packet are the lanes of a warp"}
# A method without an era form -> the method whose kernels replace its own. kd-stack runs the
# kernels of kd-texture-stack, but only in a loop: its local array does not last from pass to pass.
SAME_WALK = {"kd-stack": "kd-texture-stack"}
# A packet method -> the method whose kernels run on the chip WARPS. There, the 32 rays of a packet
# are the lanes of a warp. Each lane runs a single ray's kernels at the packet's node, without
# voting and without kd-packet's short stack. On other chips, a fragment traces a whole packet.
SINGLE_RAYS = {"kd-packet": "kd-push-down", "kd-ropes-packet": "kd-ropes",
               "bvh-packet": "bvh-threaded"}
WARPS = "G80"    # the chip whose warps run packets


def forms_of(method: str, chip: str) -> tuple[str, ...]:
    """Return the forms in which a method runs on a card. Return () if the card cannot run the
    method, or if the model has no form for it.

    The first form is the card's usual form for the method. The figures compare its times with the
    papers' times.

    Parameters
    ----------
    method : a name of the method table
    chip : a chip of FORMS
    """
    forms = FORMS[chip]
    if packets_in_loop(method, chip):
        return tuple(form for form in forms if form in ORDERS)
    if method in SINGLE_RAYS:
        return (PACKETS,) if chip == WARPS else ()
    if SAME_WALK.get(method, method) not in era_methods():
        return ()
    if method in SAME_WALK and not find_card(chip).local_arrays:
        return ()
    if method in SAME_WALK:
        return tuple(form for form in forms if form != PASSES)
    if find_method(method).steps_once:
        return tuple(form for form in forms if form == PASSES)
    return (PASSES,) if method == "brute-force" else forms


def packets_in_loop(method: str, chip: str) -> bool:
    """Return whether a fragment of the chip traces a packet of the method in a loop."""
    return chip != WARPS and GROUPS.get(chip) is not None and method in packet_methods()


def kernels_from(method: str, form: str) -> str:
    """Return the method whose kernels are compiled in place of the kernels of ``method``."""
    return (SINGLE_RAYS if form == PACKETS else SAME_WALK).get(method, method)


def counted_as(form: str) -> str:
    """Return the form whose kernel runs are counted in place of ``form``. The kernels of the form
    UNCOALESCED run exactly as often as those of WHILE_WHILE."""
    return WHILE_WHILE if form == UNCOALESCED else form
