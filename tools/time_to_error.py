"""Measures how long path tracing takes to reach the same error as Mitsuba 3 (Jakob et al. 2022).

Both renderers draw the same scene with several numbers of samples, in alternation, on all cores.
The error of a picture is measured against a picture by the same renderer with many samples, so a
small difference between the renderers counts as no error. Mitsuba runs as ``llvm_ad_rgb``. It
needs ``pip install mitsuba`` and LLVM; ``DRJIT_LIBLLVM_PATH`` names LLVM's library.
"""
from __future__ import annotations

import argparse
import statistics
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np

import gpgpu_rt as rt

SCENES = ("cornell-light", "glass-teapot")
METHOD, OPTIONS = "bvh-threaded", {"octants": True}
SAMPLES = (16, 64, 256)
TRUTH = 8          # pictures of 256 samples whose mean is a renderer's picture without noise
TURNS = 3
SAMPLER = "multijitter"    # the sampler of Mitsuba with the least error in the same time
SKY_ROWS, SKY_COLUMNS = 512, 8

Draw = Callable[[int, int], np.ndarray]     # (samples, seed) -> (size, size, 3) radiance


def own(scene: rt.Scene, size: int) -> Draw:
    tracer = rt.Tracer(scene, METHOD, **OPTIONS)

    def draw(samples: int, seed: int) -> np.ndarray:
        tracer.render(size=(size, size), integrator="path", samples=samples, seed=seed)
        return tracer.radiance
    return draw


def mitsuba_renderer(scene: rt.Scene, size: int) -> Draw:
    import mitsuba
    mitsuba.set_variant("llvm_ad_rgb")
    camera = scene.camera
    parts: dict[str, Any] = {
        "type": "scene", "integrator": {"type": "path", "max_depth": -1},
        "sensor": {
            "type": "perspective", "fov": camera.fov, "fov_axis": "y",
            "to_world": mitsuba.ScalarTransform4f().look_at(camera.eye, camera.target, camera.up),
            "film": {"type": "hdrfilm", "width": size, "height": size, "pixel_format": "rgb",
                     "rfilter": {"type": "box"}},
            "sampler": {"type": SAMPLER}}}
    if scene.environment is not None:
        parts["sky"] = {"type": "envmap", "bitmap": mitsuba.Bitmap(_sky(scene.environment))}
    colours = np.asarray(scene.colours)
    for row, material in enumerate(scene.materials):
        for colour in np.unique(colours[scene.material_of == row], axis=0):
            which = (scene.material_of == row) & (colours == colour).all(axis=1)
            parts[f"mesh {len(parts)}"] = _mesh(mitsuba, scene, which, material, colour)
    loaded = mitsuba.load_dict(parts)
    return lambda samples, seed: np.array(mitsuba.render(loaded, spp=samples, seed=seed))


def _sky(environment: Any) -> np.ndarray:
    """Return the radiance of a sky, which depends on the direction's y only, as an image of all
    directions: (SKY_ROWS, SKY_COLUMNS, 3) float32, +y in the top row."""
    height = np.cos((np.arange(SKY_ROWS) + 0.5) / SKY_ROWS * np.pi)
    directions = np.stack([np.sqrt(1 - height ** 2), height, 0 * height], axis=1)
    column = environment.radiance(directions).astype(np.float32)
    return np.repeat(column[:, None], SKY_COLUMNS, axis=1)


def _mesh(mitsuba: Any, scene: rt.Scene, which: np.ndarray, material: Any, colour: np.ndarray
          ) -> Any:
    """Return triangles of a scene as a mesh for Mitsuba, with their material."""
    if any(material.mirror) or any(material.glossy):
        sys.exit(f"material {material.name} of {scene.name} is a mirror or glossy; only diffuse "
                 "surfaces, glass and lamps are compared with Mitsuba")
    properties = mitsuba.Properties()
    properties["bsdf"] = mitsuba.load_dict(_surface(mitsuba, material, colour))
    if material.emits:
        properties["emitter"] = mitsuba.load_dict(
            {"type": "area", "radiance": {"type": "rgb", "value": list(material.emission)}})
    smooth = scene.normals is not None and bool(scene.normals[which].any())
    properties["face_normals"] = not smooth
    count = int(which.sum())
    mesh = mitsuba.Mesh(material.name, vertex_count=3 * count, face_count=count, props=properties,
                        has_vertex_normals=smooth,
                        has_vertex_texcoords=material.texture is not None)
    fields = mitsuba.traverse(mesh)
    fields["faces"] = np.arange(3 * count, dtype=np.uint32)
    fields["vertex_positions"] = np.float32(scene.triangles[which]).ravel()
    if smooth:
        fields["vertex_normals"] = np.float32(scene.normals[which]).ravel()
    if material.texture is not None:    # v is 0 in Mitsuba's first row, and 1 in this project's
        fields["vertex_texcoords"] = np.float32(scene.uv[which] * (1, -1)).ravel()
    fields.update()
    return mesh


def _surface(mitsuba: Any, material: Any, colour: np.ndarray) -> dict[str, Any]:
    if material.ior is not None:
        return {"type": "dielectric", "int_ior": material.ior, "ext_ior": 1.0}
    reflectance: dict[str, Any] = {"type": "rgb", "value": colour.tolist()}
    if material.texture is not None:
        reflectance = {"type": "bitmap", "raw": True,
                       "bitmap": mitsuba.Bitmap(np.float32(material.texture.texels))}
    return {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": reflectance}}


def relative_error(found: np.ndarray, truth: np.ndarray) -> float:
    """The mean relative error over all channels that are not black in the truth."""
    seen = truth > 0
    return float((np.abs(found - truth)[seen] / truth[seen]).mean())


def measured(draws: dict[str, Draw], truth: dict[str, np.ndarray]
             ) -> dict[str, list[tuple[float, float]]]:
    """Return (seconds, error) for each number of samples, by renderer: the median of the times and
    the mean of the errors."""
    found: dict[str, list[tuple[float, float]]] = {name: [] for name in draws}
    for samples in SAMPLES:
        times: dict[str, list[float]] = {name: [] for name in draws}
        errors: dict[str, list[float]] = {name: [] for name in draws}
        for turn in range(TURNS + 1):       # the first turn compiles and is not timed
            for name, draw in draws.items():
                begun = time.perf_counter()
                picture = draw(samples, turn)
                if turn:
                    times[name].append(time.perf_counter() - begun)
                    errors[name].append(relative_error(picture, truth[name]))
        for name in draws:
            found[name].append((statistics.median(times[name]), statistics.mean(errors[name])))
            print(f"  {name}, {samples} samples: {found[name][-1][0]:.2f} s, "
                  f"error {found[name][-1][1]:.2%}", flush=True)
    return found


def seconds_to(error: float, points: list[tuple[float, float]]) -> float:
    """Return the time to an error, interpolated between measured (seconds, error). Logarithms are
    interpolated linearly."""
    seconds, errors = np.log(np.array(points)).T
    return float(np.exp(np.interp(-np.log(error), -errors, seconds)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--size", type=int, default=128, help="pixels of a side (default: 128)")
    size = parser.parse_args().size
    for name in SCENES:
        scene = rt.load_scene(name)
        draws = {"gpgpu_rt": own(scene, size), "Mitsuba": mitsuba_renderer(scene, size)}
        truth = {who: np.mean([np.float64(draw(256, 1000 + k)) for k in range(TRUTH)], axis=0)
                 for who, draw in draws.items()}
        print(f"{name}, {size}x{size}: the pictures without noise differ by "
              f"{relative_error(truth['gpgpu_rt'], truth['Mitsuba']):.2%}", flush=True)
        points = measured(draws, truth)
        error = points["gpgpu_rt"][1][1]
        ratio = seconds_to(error, points["gpgpu_rt"]) / seconds_to(error, points["Mitsuba"])
        print(f"  time to an error of {error:.2%}: {ratio:.2f} times that of Mitsuba", flush=True)


if __name__ == "__main__":
    main()
