"""Tone map: applies an exposure and a tone curve to linear light, and rounds the result to 8 bits.

The curve decides how light above white is shown. `linear` clips the light. `reinhard` compresses
luminance by L / (1 + L), equation 3 of Reinhard et al. 2002; the exposure replaces the paper's key
value. `aces` is Narkowicz's fit (2015) to the film-like curve of the Academy Color Encoding
System, applied to each channel.
"""
from __future__ import annotations

import numpy as np

from ..options import Option
from ..scene.luminance import LUMINANCE

TONE_MAPS = ("linear", "reinhard", "aces")
EXPOSURE = Option("exposure", 0.0, "stops: the light is multiplied by 2^EXPOSURE", float,
                  minimum=-32, maximum=32, common=True)
TONE_MAP = Option("tone_map", TONE_MAPS[0], "curve that shows bright light", choices=TONE_MAPS,
                  common=True)
_BRIGHTEST = 1e30   # clip light here, so that no curve divides infinity by infinity


def is_plain(exposure: float, tone_map: str) -> bool:
    """Return whether exposure and tone curve have their defaults, which leave light unchanged."""
    return exposure == EXPOSURE.default and tone_map == TONE_MAP.default


def shown(light: np.ndarray, exposure: float = 0.0, tone_map: str = "linear") -> np.ndarray:
    """Return linear light as uint8 sRGB.

    Parameters
    ----------
    light : (..., 3) float64, linear radiance; 1 is white
    exposure : stops; the light is multiplied by 2^exposure
    tone_map : one of ``TONE_MAPS``
    """
    if not is_plain(exposure, tone_map):
        light = _mapped(np.minimum(light * 2.0 ** exposure, _BRIGHTEST), tone_map)
    light = np.clip(light, 0, 1)
    srgb = np.where(light < 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    return (srgb * 255 + 0.5).astype(np.uint8)


def _mapped(light: np.ndarray, tone_map: str) -> np.ndarray:
    if tone_map == "reinhard":
        return light / (1 + light @ LUMINANCE)[..., None]
    if tone_map == "aces":
        return light * (2.51 * light + 0.03) / (light * (2.43 * light + 0.59) + 0.14)
    return light
