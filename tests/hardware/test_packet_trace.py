"""`in_loop` inserts the kernels `push` and `pop` into a trace, in which they are parts of other
kernels. tests/traversal/test_era_packets.py compares the counts with a program of all kernels."""
from __future__ import annotations

import numpy as np

from gpgpu_rt.hardware.packet_trace import in_loop, with_more_runs
from gpgpu_rt.hardware.trace import KernelTrace

KERNELS = ("traverse", "intersect", "leave", "begin")
VISIT, TEST, LEAVE, BEGIN, POP, PUSH = 1, 2, 3, 4, 5, 6


def _column(*values: int) -> np.ndarray:
    return np.array(values)[:, None, None]


def test_runs_follow_their_steps_ray_by_ray() -> None:
    steps = np.array([[1, 2], [2, 1], [1, 0]], np.uint8)[:, None, :]
    more = {"a": np.array([[2, 0], [0, 0], [0, 9]])[:, None, :],    # a finished ray has no runs
            "b": np.array([[0, 1], [1, 0], [0, 0]])[:, None, :]}
    found = with_more_runs(KernelTrace(("x", "y"), steps), more)
    assert found.kernels == ("x", "y", "a", "b")
    assert found.steps[:, 0, 0].tolist() == [1, 3, 3, 2, 4, 1]
    assert found.steps[:, 0, 1].tolist() == [2, 4, 1, 0, 0, 0]


def test_a_visit_of_both_children_pushes_and_a_leaf_pops_or_restarts() -> None:
    """The first leaf pops two nodes, because no ray enters the first popped node. The second leaf
    finds the stack empty and restarts, which counts as one pop. A visit of a leaf does not push,
    although the field `needed` still says that both children are needed."""
    steps = _column(BEGIN, VISIT, VISIT, TEST, LEAVE, VISIT, LEAVE, VISIT, LEAVE).astype(np.uint8)
    # Each step reads the state that the previous step wrote.
    fields = {"needed": _column(0, 0, 3, 3, 3, 3, 3, 3, 3),
              "pushing": _column(0, 1, 0, 0, 0, 0, 0, 1, 1),
              "popped": _column(0, 0, 0, 0, 0, 2, 0, 0, 0)}
    trace = KernelTrace(KERNELS, steps, fields)
    assert in_loop(trace, True).steps.ravel().tolist() == [
        BEGIN, VISIT, PUSH, VISIT, TEST, LEAVE, POP, POP, VISIT, LEAVE, POP, VISIT, LEAVE]
    del fields["popped"]
    plain = in_loop(KernelTrace(KERNELS, steps, fields), False)
    assert plain.kernels == (*KERNELS, "pop")
    assert plain.steps.ravel().tolist() == [
        BEGIN, VISIT, VISIT, TEST, LEAVE, VISIT, LEAVE, POP, VISIT, LEAVE]
