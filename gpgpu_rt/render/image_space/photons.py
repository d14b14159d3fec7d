"""Photons: traces light from a point, through glass and off mirrors, to where the light lands."""
from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...reference.sampling import fresnel, refracted
from ...reference.spawn import spawn
from .patches import areas_and_normals

if TYPE_CHECKING:
    from ...tracer import Tracer

MOST_BORDERS = 8    # largest number of interfaces on a photon's way


def traced_photons(tracer: Tracer, normals: np.ndarray, origins: np.ndarray,
                   directions: np.ndarray, flux: np.ndarray) -> np.ndarray:
    """Return the points where photons land after refractions or reflections.

    At a dielectric, a photon continues with the refracted share of its flux, and the reflected
    share is dropped. After total reflection, the photon continues with all its flux.

    Parameters
    ----------
    tracer : the tracer of the scene, whose materials refract or reflect photons
    normals : (m, 3, 3) normals of the corners of the scene's triangles
    origins, directions : (n, 3) of the photons; directions have unit length
    flux : (n,) the flux of each photon

    Returns
    -------
    (n, 4) float64: each photon's landing point, and the flux there; zeros for a lost photon and
    for a photon that met no dielectric or mirror
    """
    scene = tracer.scene
    ior = np.array([m.ior or 0.0 for m in scene.materials])[scene.material_of]
    mirror = np.array([np.mean(m.mirror) for m in scene.materials])[scene.material_of]
    landed = np.zeros((len(origins), 4))
    photons, start = np.arange(len(origins)), np.asarray(origins, np.float32)
    ways, flux = np.asarray(directions, np.float64), np.array(flux, np.float64)
    for border in range(MOST_BORDERS + 1):
        hits = tracer.trace(start, ways)
        some = hits.hit
        photons, ways = photons[some], ways[some]
        for name in ("t", "u", "v", "triangle", "status"):
            setattr(hits, name, getattr(hits, name)[some])
        rows = hits.triangle
        weights = np.stack([1 - hits.u - hits.v, hits.u, hits.v], axis=1)
        corners = scene.triangles[rows].astype(np.float64)
        turned = (ior[rows] > 0) | (mirror[rows] > 0)
        if border:
            place = np.einsum("nc,ncx->nx", weights, corners)
            landed[photons[~turned]] = np.column_stack([place, flux[photons]])[~turned]
        _, flat = areas_and_normals(corners)
        outside = (flat * ways).sum(1) <= 0
        side = np.where(outside, 1, -1)[:, None]
        normal = np.einsum("nc,ncx->nx", weights, normals[rows].astype(np.float64)) * side
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
        cosine = np.clip(-(normal * ways).sum(1), 1e-6, 1)
        ratio = np.where(outside, ior[rows], 1 / np.where(ior[rows] > 0, ior[rows], 1))
        glass = ior[rows] > 0
        back = np.where(glass, fresnel(cosine, np.where(glass, ratio, 1)), 0)
        bounced = ways + 2 * cosine[:, None] * normal
        through = refracted(ways, normal, np.where(glass, ratio, 1))
        total = back >= 1
        ways = np.where((glass & ~total)[:, None], through, bounced)
        flux[photons] *= np.where(glass, np.where(total, 1, 1 - back), mirror[rows])
        start = spawn(scene, hits, ways)[turned]
        photons, ways = photons[turned], ways[turned]
        if not len(photons):
            break
    return landed
