"""Fixtures and functions that all tests share: context, scenes, rays, comparisons of hits, and
the check for GL errors."""
from __future__ import annotations

import itertools
import os
import tempfile
from collections.abc import Generator, Iterable, Iterator, Mapping
from pathlib import Path

import hypothesis
import numpy as np
import pytest
import trimesh
from angle_exceptions import skip_exceptions
from chart_rules import checked_charts

import gpgpu_rt as rt
from gpgpu_rt.gl.context import Gpu, open_gpu
from gpgpu_rt.methods import find_method
from gpgpu_rt.methods.bvh.gpu_build.build import GPU_BUILDS
from gpgpu_rt.methods.bvh.tree import Bvh
from gpgpu_rt.methods.kdtree.gpu_build.build import GPU_KD_BUILDS
from gpgpu_rt.numerics.denormals import flushed
from gpgpu_rt.options import clashing
from gpgpu_rt.rays import ray_sets
from gpgpu_rt.scene import catalogue
from gpgpu_rt.traversal.own_arrays import MIXED_UP
from gpgpu_rt.viewer import Selection, Viewer
from gpgpu_rt.workers import Workers

__all__ = ["checked_charts"]     # a fixture of all tests

# The tests have a new, empty cache, so they build each structure themselves, but only once.
_CACHE = tempfile.TemporaryDirectory(prefix="gpgpu_rt_tests")
os.environ["GPGPU_RT_CACHE"] = _CACHE.name
# Tests find fetched scenes only through GPGPU_RT_SCENES, so that a test can hide the scenes.
if "GPGPU_RT_SCENES" not in os.environ and catalogue.data_folder().is_dir():
    os.environ["GPGPU_RT_SCENES"] = str(catalogue.data_folder())
os.environ["XDG_DATA_HOME"] = _CACHE.name

# A test of Hypothesis has no deadline, because its time depends on the machine's load.
hypothesis.settings.register_profile("untimed", deadline=None)
hypothesis.settings.load_profile("untimed")

FOLEY = ("cornell", "bunny", "robots", "kitchen")
# These methods have no structure over the triangles, so scattered rays test nearly all triangles.
UNSTRUCTURED = ("brute-force", "ray-tiles", "ray-hierarchy")
RAY_SETS = {
    "eye": lambda scene, n, seed: ray_sets.eye_rays(scene, n),
    "random": ray_sets.random_rays,
    "surface": ray_sets.surface_rays,
    "vertices": lambda scene, n, seed: ray_sets.aimed_rays(scene, n, seed, at="vertices"),
    "edges": lambda scene, n, seed: ray_sets.aimed_rays(scene, n, seed, at="edges"),
}


# Renderers that round as IEEE 754 demands, so their results have the same bits as numpy's.
EXACT = ("llvmpipe", "SwiftShader")
# Renderers that give the same bits for the same `precise` arithmetic in every program.
PRECISE = (*EXACT, "NVIDIA")

SCHEDULES: dict[str, dict[str, object]] = {
    "loop": {"schedule": "loop"},
    "step1": {"schedule": "step"},
    "step16": {"schedule": "step", "steps_per_pass": 16},
    # Passes write states alternately into two buffers. It would be a fault to mask a ray before
    # both buffers hold its final state. An even mask interval hides the fault, because every mask
    # and the result then use the same buffer.
    "step1-mask3": {"schedule": "step", "mask_interval": 3},
    "kernels": {"schedule": "kernels"},
    "kernels-mask2": {"schedule": "kernels", "mask_interval": 2},
}


def schedules_of(row: rt.Method, names: Iterable[str] = SCHEDULES,
                 options: Mapping[str, object] | None = None) -> dict[str, dict[str, object]]:
    """Return the settings of the named schedules that a method supports with these options."""
    return {name: SCHEDULES[name] for name in names
            if SCHEDULES[name]["schedule"] in row.schedules_for(options or {})
            and not (row.steps_once and "steps_per_pass" in SCHEDULES[name])}


# The tests marked `full` in these folders build structures, count operations or draw pages of
# figures. Their results do not depend on the OpenGL backend, so these tests run on one backend.
ON_ANY_BACKEND = ("accel", "figures", "reference")


def pytest_runtest_teardown(item: pytest.Item) -> None:
    """Fail a test if the processor flushes denormal numbers after the test. Later tests would
    otherwise lose hits."""
    assert not flushed(), f"after {item.nodeid} the processor flushes denormal numbers to 0"


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if item.path.parent.name in ON_ANY_BACKEND and item.get_closest_marker("full"):
            item.add_marker(pytest.mark.once)
    if os.environ.get("GPGPU_RT_CONTEXT") == "angle":
        skip_exceptions(items)


def pytest_report_header() -> str:
    gpu = open_gpu()
    return f"OpenGL: {gpu.backend}, {gpu.renderer}, {gpu.version}"


@pytest.fixture(scope="session")
def gpu() -> Gpu:
    return open_gpu()


@pytest.fixture(autouse=True)
def no_gl_error(gpu: Gpu) -> Iterator[None]:
    """Check for a GL error before and after each test, because GL records errors silently."""
    with gpu:
        assert gpu.context.error == "GL_NO_ERROR", "an earlier test left a GL error"
        yield
        gpu.context.__enter__()   # a test may have made another context current
        assert gpu.context.error == "GL_NO_ERROR"


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, object, object]:
    """Skip a test on softpipe if its method keeps a stack in an array.

    softpipe mixes up the arrays of different fragments, so the tracer refuses such a method with
    an error. On other renderers, this error is a failure of the test.
    """
    try:
        return (yield)
    except rt.LimitError as limit:
        if MIXED_UP in str(limit) and "softpipe" in open_gpu().renderer:
            pytest.skip(str(limit))
        raise


@pytest.fixture
def exact_renderer(gpu: Gpu) -> Gpu:
    """Skip the test if this renderer's bits may differ from numpy's."""
    return _one_of(gpu, EXACT)


@pytest.fixture
def precise_renderer(gpu: Gpu) -> Gpu:
    """Skip the test if this renderer may give different bits for the same `precise` arithmetic in
    two programs."""
    return _one_of(gpu, PRECISE)


def _one_of(gpu: Gpu, names: tuple[str, ...]) -> Gpu:
    if not any(name in gpu.renderer for name in names):
        pytest.skip(f"this test compares bits and runs only on {' and '.join(names)}; this "
                    f"renderer is {gpu.renderer}")
    return gpu


def variants(name: str) -> list[dict[str, object]]:
    """Return a list of settings of a method: first the defaults, {}, and then settings that change
    one of the method's own options.

    Each choice of an option gives a setting, except the default and choices with which a search
    may lose hits. A boolean option gives the opposite of its default. An integer option gives 6 if
    it is a program constant whose default is 0 (off). If an option needs another option, the
    setting also contains the other option.
    """
    settings: list[dict[str, object]] = [{}]
    for option in find_method(name).options:
        needs = {} if option.goes_with is None else {option.goes_with[0]: option.goes_with[1][0]}
        if option.choices:
            settings += [{**needs, option.name: c} for c in option.choices
                         if c != option.default and c not in option.relaxed]
        elif option.kind is bool:
            settings.append({**needs, option.name: not option.default})
        elif option.kind is int and option.define and not option.default:
            settings.append({**needs, option.name: 6})
    return [given for given in settings if buildable(name, given)]


def buildable(name: str, given: dict[str, object]) -> bool:
    """Return whether the builder of these settings can run on their device (CPU or GPU)."""
    options = {**{option.name: option.default for option in find_method(name).options}, **given}
    builds = GPU_KD_BUILDS if name.startswith("kd-") else GPU_BUILDS
    return options.get("build_device") != "gpu" or options["build"] in builds


def variant_pairs(name: str) -> list[dict[str, object]]:
    """Return the settings that combine two variants, if the variants set different options that
    may be used together."""
    single = variants(name)[1:]
    pairs = ({**one, **other} for one, other in itertools.combinations(single, 2)
             if not set(one) & set(other))
    return [pair for pair in pairs if buildable(name, pair)
            and not clashing(pair, find_method(name).options)]


def real_scene(name: str) -> rt.Scene:
    """Return a scene from its real mesh, or skip the test if the mesh is not found."""
    if catalogue.mesh_path(name) is None:
        pytest.skip(f"no mesh of {name} in GPGPU_RT_SCENES or ./scenes; `gpgpu-rt scenes "
                    "--fetch` gets it")
    return rt.load_scene(name)


def random_soup(count: int, seed: int, size: float = 0.2) -> np.ndarray:
    """Return (count, 3, 3) float32 triangles in and around the unit box, of which a few are flat
    or tiny."""
    rng = np.random.default_rng(seed)
    corners = rng.random((count, 1, 3)) + size * rng.normal(size=(count, 3, 3))
    corners[::7, :, seed % 3] = corners[::7, :1, seed % 3]     # flat along an axis
    corners[::13] = corners[::13, :1] + 1e-4 * rng.normal(size=(len(corners[::13]), 3, 3))
    return corners.astype(np.float32)


def soup_scene(count: int, seed: int, size: float = 0.2) -> rt.Scene:
    corners = random_soup(count, seed, size).reshape(-1, 3)
    return rt.Scene.from_arrays(corners, np.arange(len(corners)).reshape(-1, 3), name="soup")


def part_of(hits: rt.Hits, some: slice) -> rt.Hits:
    """Return the hits of some rays. ``some`` is a slice or an array of indices."""
    return rt.Hits(*(getattr(hits, name)[some] for name in ("t", "u", "v", "triangle", "status")))


def assert_same_bits(hits: rt.Hits, expected: rt.Hits, allowed: float = 0.0) -> None:
    """Check that t, triangle, u and v have the same bits.

    At most a share ``allowed`` of the rays may differ.
    """
    differing = np.zeros(len(hits), bool)
    for name in ("t", "u", "v", "triangle"):
        differing |= getattr(hits, name) != getattr(expected, name)
    assert differing.sum() <= allowed * len(hits), (
        f"{differing.sum()} of {len(hits)} rays differ, first {np.flatnonzero(differing)[:5]}: "
        f"t {hits.t[differing][:3]} against {expected.t[differing][:3]}, triangle "
        f"{hits.triangle[differing][:3]} against {expected.triangle[differing][:3]}")


def assert_same_hits(hits: rt.Hits, oracle: rt.Hits, extent: float, allowed: float) -> None:
    """Check hits against the float64 oracle. The error of t may be 1e-4 t plus 1e-6 of the extent.

    At most a share ``allowed`` of the rays may differ.
    """
    both = hits.hit & oracle.hit
    t, expected = hits.t[both].astype(np.float64), oracle.t[both]
    wrong = hits.hit != oracle.hit
    wrong[both] = np.abs(t - expected) > 1e-4 * expected + 1e-6 * extent
    assert wrong.sum() <= allowed * len(hits), (
        f"{wrong.sum()} of {len(hits)} rays wrong, first {np.flatnonzero(wrong)[:5]}: "
        f"{hits.t[wrong][:3]} against {oracle.t[wrong][:3]}")


def assert_threaded(bvh: Bvh, triangles: np.ndarray) -> None:
    """Check that a BVH has all triangles, that its nodes are in depth-first order, and that its
    escape links are right. A node's escape link is the first node after the node's subtree.

    The box of an inner node must be the smallest box around its children's boxes. The box of a
    leaf must contain the leaf's triangles.
    """
    assert (np.sort(bvh.order) == np.arange(len(triangles))).all()
    if not len(triangles):
        return
    nodes = np.arange(len(bvh.escape))
    leaf = bvh.count > 0
    assert (bvh.escape > nodes).all() and bvh.escape[0] == len(nodes)
    assert (bvh.escape[leaf] == nodes[leaf] + 1).all()
    left = nodes[~leaf] + 1
    right = bvh.escape[left]
    assert (bvh.escape[right] == bvh.escape[~leaf]).all()
    for bound, corner in ((np.minimum, bvh.lo), (np.maximum, bvh.hi)):
        assert (bound(corner[left], corner[right]) == corner[~leaf]).all()
    owner = np.repeat(nodes[leaf], bvh.count[leaf])
    at = np.concatenate([np.arange(f, f + c) for f, c in zip(bvh.first[leaf], bvh.count[leaf])])
    inside = triangles[bvh.order[at]]
    assert (inside >= bvh.lo[owner, None]).all() and (inside <= bvh.hi[owner, None]).all()


# Processes --------------------------------------------------------------------------------------


@pytest.fixture(scope="session")
def _workers() -> Iterator[Workers]:
    pytest.importorskip("distributed")
    with Workers(count=2, threads=1) as found:
        yield found


@pytest.fixture
def workers(_workers: Workers) -> Workers:
    """Wait until killed workers have restarted. Return the two workers that all tests share."""
    _workers.client.wait_for_workers(2, timeout=300)
    return _workers


@pytest.fixture
def address(workers: Workers) -> str:
    """Return the address of the workers' scheduler."""
    return workers.client.scheduler.address


# Viewers without a window -----------------------------------------------------------------------

VIEW = (48, 36)   # picture size of these viewers, in pixels


class Clock:
    """A clock that shows the time ``now``, which a test sets."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def soup(tmp_path: Path) -> str:
    """Return the path of a mesh file."""
    corners = random_soup(60, seed=5).reshape(-1, 3)
    path = tmp_path / "soup.ply"
    trimesh.Trimesh(corners, np.arange(len(corners)).reshape(-1, 3), process=False).export(path)
    return str(path)


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def viewer(soup: str, clock: Clock) -> Iterator[Viewer]:
    one = Viewer(Selection(soup), VIEW, clock=clock)
    yield one
    one.release()
