"""Measure the costs of methods and precisions, and their errors against the float64 reference."""
from __future__ import annotations

import functools
import statistics
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from typing import Any

import numpy as np

from ..errors import OptionError, how_to_install, nearest_names
from ..methods import find_method, methods, option_table, taking
from ..reference.picture import reference_picture
from ..scene.scene import Scene
from ..tracer import Tracer
from .candidates import FULL_PRECISION, STEP_ROOM, precisions
from .known_rays import KINDS, KnownRays, check_kinds

RUNS = 3
MOST_PAIRS = 1 << 25    # largest number of (ray, triangle) pairs that brute-force tests
FORMATS = ("precision", "storage", "arithmetic")
FLIP_MISSING = f"FLIP needs the package flip-evaluator; {how_to_install('figures')}"


class Yardstick:
    """The reference for all measurements of a scene: rays with the hits of the float64 reference,
    and a picture.

    Parameters
    ----------
    scene : Scene
    rays : number of rays of each kind
    seed : seed of the rays
    size : (width, height) of the picture in pixels
    kinds : names from ``known_rays.KINDS``
    """

    def __init__(self, scene: Scene, rays: int, seed: int = 0, size: tuple[int, int] = (256, 256),
                 kinds: Sequence[str] = KINDS) -> None:
        if rays < 1:
            raise OptionError(f"{rays} rays cannot measure anything; give 1 or more")
        check_kinds(kinds)
        self.scene, self.count, self.seed, self.size = scene, rays, seed, size
        self.kinds = tuple(kinds)
        self._known: dict[int, KnownRays] = {}

    def rays(self, most: int | None = None) -> KnownRays:
        """Return the known rays, at most ``most`` of each kind."""
        count = self.count if most is None else max(1, min(self.count, most))
        if count not in self._known:
            self._known[count] = KnownRays(self.scene, count * len(self.kinds), self.seed,
                                           self.kinds)
        return self._known[count]

    @functools.cached_property
    def picture(self) -> np.ndarray:
        """The reference picture, (height, width, 3) float64 sRGB: multiples of 1/255 in [0, 1].

        It is rounded as the pictures of `Tracer.render` are, so that equal pictures have no error.
        """
        return np.round(reference_picture(self.scene, self.size) * 255) / 255

    def measure(self, method: str, options: Mapping[str, Any], runs: int = RUNS,
                timing: Callable[[], AbstractContextManager[Any]] = nullcontext) -> dict[str, Any]:
        """Return the cost and the errors of a method with options.

        Parameters
        ----------
        timing : returns a context manager, inside which all measured traces run. For each kind of
            rays, an untimed trace comes first, and then ``runs`` timed traces

        Returns
        -------
        dict
            ``method``, ``precision`` and ``options`` name the candidate, and ``rays`` is the
            number of rays of each kind. ``kinds`` has an entry for each kind of rays: the score
            (`known_rays.Score`), ``seconds`` (median time of the passes), ``rays_per_second``
            and ``passes``. ``all`` is such an entry for all kinds together. ``texture_bytes`` is
            the size of all textures. ``image`` compares a picture with the reference picture:
            ``rmse``, ``differing`` (share of pixels that differ by more than 1/255), and ``flip``
            (the mean FLIP, or None). ``image`` is None if drawing would take minutes
        """
        with_cap, known = self._capped(method, options), self.rays(self._most(method))
        row: dict[str, Any] = {"method": method, "precision": _precision(options),
                               "options": with_cap, "rays": len(known) // len(self.kinds)}
        with Tracer(self.scene, method, **with_cap) as tracer:
            hits, _ = known.trace(tracer)
            answers = known.judge(hits)
            row["kinds"] = {}
            with timing():
                for kind, part in known.parts.items():
                    known.trace(tracer, part)
                    seconds = [known.trace(tracer, part)[1] for _ in range(runs)]
                    row["kinds"][kind] = _cost(answers.score(part).to_dict(), seconds)
                    row["kinds"][kind]["passes"] = tracer.statistics.passes
            row["texture_bytes"] = tracer.statistics.texture_bytes
            total = sum(k["seconds"] for k in row["kinds"].values())
            row["all"] = _cost(answers.score().to_dict(), [total])
            row["all"]["passes"] = sum(k["passes"] for k in row["kinds"].values())
            row["image"] = self._image_error(tracer)
        return row

    def _capped(self, method: str, options: Mapping[str, Any]) -> dict[str, Any]:
        """Return the options. If they lower the accuracy, add a step cap, because low precision
        can send a ray around an endless loop. The cap is STEP_ROOM times the largest number of
        steps of a ray at full accuracy.
        """
        table = option_table(method)
        relaxed = [name for name, value in options.items() if value in table[name].relaxed or (
            name in FORMATS and value not in FULL_PRECISION)]
        if not relaxed or "step_cap" in options or options.get("era"):
            return dict(options)
        exact = {name: value for name, value in options.items() if name not in relaxed}
        return {**options, "step_cap": STEP_ROOM * self._steps(method, tuple(exact.items()))}

    @functools.lru_cache(maxsize=64)
    def _steps(self, method: str, options: tuple[tuple[str, Any], ...]) -> int:
        most = self._most(method)
        return self.rays(4096 if most is None else min(most, 4096)).most_steps(
            method, dict(options))

    def _most(self, method: str) -> int | None:
        """Return the largest number of rays of each kind for a method; None for no limit."""
        if method != "brute-force":
            return None
        return max(1, MOST_PAIRS // (max(1, len(self.scene)) * len(self.kinds)))

    def _image_error(self, tracer: Tracer) -> dict[str, float | None] | None:
        most = self._most(tracer.method.name)
        if most is not None and self.size[0] * self.size[1] > 8 * most:
            return None
        picture = np.asarray(tracer.render(size=self.size), np.float64) / 255
        difference = picture - self.picture     # a multiple of 1/255
        return {"rmse": float(np.sqrt((difference ** 2).mean())),
                "differing": float((np.abs(difference).max(axis=2) > 1.5 / 255).mean()),
                "flip": _flip(self.picture, picture)}


def accuracy(scene: Scene, names: Sequence[str] | None = None,
             formats: Sequence[str] | None = None, options: Mapping[str, Any] | None = None,
             rays: int = 1 << 14, size: tuple[int, int] = (256, 256), seed: int = 0,
             report: Callable[[str], None] = lambda line: None) -> list[dict[str, Any]]:
    """Return a row of `Yardstick.measure` for every method and precision.

    Parameters
    ----------
    scene : Scene
    names : methods; None for all methods that have the options
    formats : precisions; None for all precisions, or, with the option ``era``, the precision of
        the chip
    options : further options of the tracer and the methods
    rays : number of rays of each kind; `brute-force` traces fewer if it would test more than 2^25
        pairs
    size : (width, height) of the compared pictures in pixels
    seed : seed of the rays
    report : called with each line about progress
    """
    candidates, given = [], dict(options or {})
    if "precision" in given:
        raise OptionError("leave out the option precision; give the precisions to measure by the "
                          "parameter formats (--precisions)")
    if names is None:
        names = [row.name for row in taking(given)]
        left = [row.name for row in methods() if row.name not in names]
        if left:
            report(f"left out: {', '.join(left)} (they do not have these options)")
    for name in names:
        resolved = find_method(name).resolved(given)
        table, known = option_table(name), precisions(name)
        if resolved["era"]:
            known = [resolved["precision"]]
            if formats is not None and list(formats) != known:
                raise OptionError(f"method {name}: era={resolved['era']} computes in {known[0]}; "
                                  "leave out the parameter formats (--precisions)")
        for word in known if formats is None else formats:
            if word not in known:
                raise OptionError(f"method {name} has no precision {word!r}"
                                  + nearest_names(word, known))
            candidates.append((name, {**given, "precision": word} if "precision" in table
                               else given))
    report(f"{scene.name}: tracing {rays:,} rays of each kind with the reference")
    yardstick = Yardstick(scene, rays, seed, size)
    rows = []
    for at, (name, chosen) in enumerate(candidates, 1):
        report(f"{at} of {len(candidates)}: "
               + " ".join([name, *(f"{k}={v}" for k, v in chosen.items())]))
        rows.append(yardstick.measure(name, chosen))
    return rows


def flip_note() -> str | None:
    """Return the reason why FLIP is not computed; None if FLIP is computed."""
    return None if _flip_evaluator() is not None else FLIP_MISSING


def _precision(options: Mapping[str, Any]) -> str:
    whole = options.get("precision")
    parts = [options.get(part) or whole or "fp32" for part in ("storage", "arithmetic")]
    return parts[0] if parts[0] == parts[1] else "/".join(parts)


def _cost(score: dict[str, Any], seconds: list[float]) -> dict[str, Any]:
    median = statistics.median(seconds)
    return {**score, "seconds": median,
            "rays_per_second": score["rays"] / median if median else 0.0}


@functools.cache
def _flip_evaluator() -> Any:
    try:
        import flip_evaluator
    except ImportError:
        return None
    return flip_evaluator


def _flip(reference: np.ndarray, picture: np.ndarray) -> float | None:
    """Return the mean FLIP of two sRGB pictures at the default viewing distance; None without the
    package. FLIP measures visible differences (Andersson et al. 2020)."""
    evaluator = _flip_evaluator()
    if evaluator is None:
        return None
    return float(evaluator.evaluate(reference.astype(np.float32), picture.astype(np.float32),
                                    "LDR", applyMagma=False)[1])
