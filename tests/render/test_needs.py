"""A renderer uses only the defines, textures and passes that its scene needs. The picture equals
the picture that a renderer with all features draws."""
from __future__ import annotations

import numpy as np
import pytest
from looks import ALONE, everything, plain

import gpgpu_rt as rt
from gpgpu_rt.render.needs import PROPERTIES, Asked, SceneNeeds
from gpgpu_rt.render.plan import Plan

SIZE = (24, 16)
SHADOWS = {"triangle", "direct", "shadow rays"}
GATHERED = {"radiance"}
REFLECTED = {"reflected 0", "reflected 0 paths", "reflected 1", "reflected 1 paths", "live tiles"}
BOUNCES = {"reflect", "live tiles", "gather"}

# The defines, textures and passes that each property alone adds to the plain scene. TAKES lists
# the defines that a property removes.
ADDS: dict[str, tuple[set[str], set[str], set[str]]] = {
    "colours": ({"COLOURS"}, {"colour"}, set()),
    "smooth normals": ({"SMOOTH_NORMALS"}, {"corner_normals"}, set()),
    "textures": ({"MATERIALS", "TEXTURES"}, {"corner_uv", "image", "images"}, set()),
    "emitters": ({"MATERIALS", "EMITTERS", "AREA_LIGHTS", "SHADOWS", "MANY_LIGHTS", "GATHERED"},
                 {"emission", "kept hits", *SHADOWS, *GATHERED}, {"keep hits", "gather"}),
    "glossy": ({"MATERIALS", "GLOSSY"}, {"glossy"}, set()),
    "point light": ({"POINT_LIGHTS", "SHADOWS"}, SHADOWS, set()),
    "two point lights": ({"POINT_LIGHTS", "SHADOWS", "MANY_LIGHTS", "GATHERED"},
                         {"kept hits", *SHADOWS, *GATHERED}, {"keep hits", "gather"}),
    "mirrors": ({"MATERIALS", "MIRRORS", "BOUNCES", "GATHERED"},
                {"mirror", "triangle", *REFLECTED, *GATHERED}, BOUNCES),
    "dielectrics": ({"COLOURS", "MATERIALS", "DIELECTRICS", "BOUNCES", "GATHERED"},
                    {"colour", "dielectric", "triangle", *REFLECTED, *GATHERED,
                     *(f"refracted {k}{what}" for k in range(1, 9) for what in ("", " paths"))},
                    {"refract", *BOUNCES}),
    "darkness": (set(), set(), set()),
    "backdrop": ({"BACKDROP"}, set(), set()),
    "environment image": ({"SKY_IMAGE"}, {"surroundings_image"}, set()),
    "moving": ({"MOVING"}, set(), set()),
}
TAKES = {"darkness": {"SKY"}, "backdrop": {"SKY"}, "environment image": {"SKY"}}


def plan_of(scene: rt.Scene) -> Plan:
    with rt.Tracer(scene, "brute-force") as tracer:
        return tracer.plan(SIZE)


@pytest.mark.parametrize("name", ALONE)
def test_each_property_adds_only_what_it_needs(name: str) -> None:
    base, plan = plan_of(plain()), plan_of(ALONE[name](plain()))
    defines, textures, passes = ADDS[name]
    assert set(plan.defines) - set(base.defines) == defines
    assert set(base.defines) - set(plan.defines) == TAKES.get(name, set())
    assert set(plan.textures) - set(base.textures) == textures
    assert set(plan.passes) - set(base.passes) == passes
    assert not set(base.textures) - set(plan.textures)
    assert not set(base.passes) - set(plan.passes)


def test_the_plain_scene_needs_next_to_nothing() -> None:
    plan = plan_of(plain())
    assert plan.defines == ("SKY",) and plan.passes == ("eye rays", "surfaces", "picture")
    own = {name for name in plan.textures if not name.startswith("the method's")}
    assert own == {"eye rays", "state and hits", "surface", "lit", "screen"}


def test_every_property_is_tested_alone() -> None:
    """A new row of PROPERTIES needs a row in ADDS. The properties of paths are tested in
    test_path.py."""
    found = {define for defines, _, _ in ADDS.values() for define in defines} | {"SKY"}
    assert found == {define for p in PROPERTIES if not p.of_paths
                     for define in p.defines}


@pytest.mark.parametrize("name", [*ALONE, "everything"])
def test_the_picture_of_all_features_is_the_same(precise_renderer, name: str) -> None:
    """Drawing with all features changes no pixel, and saves no passes, fetches or bytes."""
    scene = everything() if name == "everything" else ALONE[name](plain())
    options = {"bounces": 2, "light_samples": 3}
    with rt.Tracer(scene, "bvh-threaded") as tracer:
        derived = np.asarray(tracer.render(size=SIZE, **options))
        needed = tracer.statistics.to_dict()
        forced = np.asarray(tracer.render(size=SIZE, all_features=True, **options))
        all_of_it = tracer.statistics.to_dict()
    assert (derived == forced).all() and (np.ptp(derived) > 0 or name == "darkness")
    for count in ("passes", "draw_calls", "waves", "texel_fetches", "texture_bytes"):
        assert needed[count] <= all_of_it[count], count
    for kind, drawn in needed["picture_passes"].items():
        assert drawn <= all_of_it["picture_passes"][kind]


def test_the_plan_says_why_parts_are_left_out() -> None:
    """The plan gives a reason for each define, texture and pass that was left out."""
    plan = plan_of(ALONE["point light"](plain()))
    assert plan.left_out["define"]["MIRRORS"] == "no material is a mirror"
    assert plan.left_out["texture"]["corner_normals"] == "the mesh has no normals"
    assert plan.left_out["pass"]["keep hits"] == "a hit needs at most one shadow ray"
    words = "\n".join(plan.lines())
    for names in plan.left_out.values():
        for name, reason in names.items():
            assert name in words and reason in words and reason
    with rt.Tracer(plain(), "brute-force") as tracer:
        direct = tracer.plan(SIZE, "direct")
    assert direct.left_out["define"]["MIRRORS"] == "no bounces are followed"


@pytest.mark.parametrize("name", ["point light", "dielectrics", "everything"])
def test_the_plan_counts_every_byte(name: str) -> None:
    scene = everything() if name == "everything" else ALONE[name](plain())
    with rt.Tracer(scene, "bvh-threaded") as tracer:
        planned = sum(tracer.plan(SIZE).textures.values())
        tracer.render(size=SIZE)
        assert tracer.statistics.texture_bytes == planned


@pytest.mark.parametrize("share, bounces", [(0.5, 10), (0.1, 3), (0.9, 65), (1.0, 99)])
def test_mirrors_that_weigh_too_little_are_not_followed(share: float, bounces: int) -> None:
    """After k bounces off mirrors of share s, a ray has the weight s^k. A plan has only the
    bounces after which this weight is at least CUTOFF."""
    from looks import with_material
    scene = with_material(plain(), 1, rt.Material("m", mirror=(share,) * 3))
    assert SceneNeeds.of(scene, Asked(bounces=99)).bounces == bounces
