"""Messages about the chips and methods that have no era form (docs/era.md)."""
from __future__ import annotations

from ..errors import OptionError, did_you_mean
from ..hardware.cards import find_card
from ..methods import find_method, methods
from ..options import ERAS

NV30 = "the NV30 is left out, because it has a single render target (docs/era.md)"


def check_era(text: str) -> None:
    """Raise OptionError if ``text`` is no chip of the option ``era``. The message names the cards
    of the chips."""
    chip = text.lower()
    known = ", ".join(f"{one} ({find_card(one).name})" for one in ERAS)
    if chip == "nv30":
        raise OptionError(f"option era={text!r}: {NV30}; give one of {known}")
    if chip == "g80":
        raise OptionError(f"option era={text!r} is none of {known}: the G80 has integers and "
                          "loops, so there is no era form to run; its times are predicted "
                          "by `gpgpu-rt hardware --predict METHOD` (docs/hardware.md)")
    if chip not in (*ERAS, "none", "null"):
        raise OptionError(f"option era={text!r} is none of {known}{did_you_mean(chip, ERAS)}")


def check_era_form(method: str, chip: str) -> None:
    """Raise OptionError for a method that has no era form, whatever its options. The message names
    the methods that have an era form."""
    if reason := find_method(method).why_no_era_form():
        known = ", ".join(row.name for row in methods() if not row.why_no_era_form(chip))
        raise OptionError(f"method {method} has no era form: {reason}; methods with an era form: "
                          f"{known}")
