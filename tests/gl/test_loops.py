"""`without_do` rewrites a do-while loop as a for loop: the condition moves from the loop's end to
the loop's head."""
from __future__ import annotations

import pytest

from gpgpu_rt.gl.loops import without_do


@pytest.mark.parametrize("text, told", [
    ("int x = 0; while (x < 3) { ++x; }", "int x = 0; while (x < 3) { ++x; }"),
    ("do { ++x; } while (x < f(3));",
     "for (bool again_0 = true; again_0; again_0 = (x < f(3))) { ++x; }"),
    ("do { do { ++y; } while (y < 2); // } no end\n ++x; } while (x\n < 3);\nint z;",
     "for (bool again_0 = true; again_0; again_0 = (x < 3)) { for (bool again_1 = true; again_1; "
     "again_1 = (y < 2)) { ++y; } // } no end\n ++x; }\n\nint z;")])
def test_a_loop_tests_its_condition_before_the_next_iteration(text: str, told: str) -> None:
    assert without_do(text) == told
    assert without_do(text).count("\n") == text.count("\n")


def test_a_do_without_a_while_is_refused() -> None:
    with pytest.raises(ValueError, match="no while"):
        without_do("do { ++x; }")
