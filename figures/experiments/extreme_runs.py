"""Extreme runs: measures the extreme cases, and judges the rays of each case."""
from __future__ import annotations

import functools
import hashlib
from typing import Any

import gpgpu_rt as rt
from gpgpu_rt.accuracy.judge import judge, leaks
from gpgpu_rt.conform.case import FAMILIES, Case
from gpgpu_rt.conform.families import make_case

SEED = 1
# Cases whose rays need more steps than the step cap of some measurements. These cases are traced
# without the cap.
LONG = ("coincident", "long-way")


def measure(method: str, options: dict[str, Any], rays: int) -> dict[str, dict[str, Any]]:
    """Trace every case by one method with ``options``. Return case -> the verdict on its rays."""
    return {name: _measure_one(name, method, options, min(rays, FAMILIES[name].most))
            for name in FAMILIES}


@functools.cache
def _known(name: str, rays: int) -> tuple[Case, rt.Hits]:
    case = make_case(name, rays, SEED)
    return case, rt.reference.trace(case.triangles, *case.rays, accelerated=True)


def _measure_one(name: str, method: str, options: dict[str, Any], rays: int) -> dict[str, Any]:
    case, reference = _known(name, rays)
    chosen = {**case.options.get(method, {}), **options}
    if name in LONG:
        chosen.pop("step_cap", None)
    with rt.Tracer(case.scene, method, statistics=True, **chosen) as tracer:
        hits = tracer.trace(*case.rays)
        cap = tracer.step_cap
    verdict = judge(case.triangles, case.origins, case.directions, hits, case.t_min, case.t_max,
                    reference=reference)
    assert hits.steps is not None
    return {**verdict.to_dict(), "missed": int(leaks(reference, hits).sum()),
            "closed_leaks": int((~hits.hit).sum()) if case.closed else None,
            "steps": float(hits.steps.mean()), "most_steps": int(hits.steps.max()), "cap": cap,
            "capped": int((hits.status == 2).sum())}


@functools.cache
def digest() -> str:
    """Return a digest of the triangles and rays of all cases, with 16 rays each."""
    total = hashlib.sha256()
    for name in FAMILIES:
        case = make_case(name, 16, SEED)
        for array in (case.triangles, *case.rays):
            total.update(array.tobytes())
    return total.hexdigest()
