"""``gpgpu-rt accuracy``, ``tune``: measure errors; find the fastest settings within bounds."""
from __future__ import annotations

import argparse
import json
import sys
from typing import Any

from ..accuracy.error_targets import ALL, OWN_KIND, Promise
from ..accuracy.known_rays import KINDS, WITHIN_BOUND, WRONG
from ..accuracy.measure import RUNS, accuracy, flip_note
from ..accuracy.tune import LATE, SCREEN, tune
from ..accuracy.tuning_results import Search, Trial
from ..disk.files import check_writable, replacing
from ..errors import Error
from ..gl.context import open_gpu
from ..gl.environment import run_facts
from ..methods import settings
from ..scene.loading import load_scene
from ..scene.scene import Scene
from ..text_format import number
from .shared import (
    Command, add_methods, add_options, count_word, given_options, names, print_json,
    print_stand_in, print_table, say, seconds_word, size_word, whole_word
)


def add_commands(command: Command) -> None:
    sub = command("accuracy", _accuracy, "measure the errors of methods and precisions against "
                  "the float64 reference; the lines below the table explain its columns")
    sub.add_argument("scene", help="a scene's name or a mesh file")
    add_methods(sub, "all methods that have the given options")
    sub.add_argument("--precisions", type=names, metavar="NAME,NAME,...",
                     help="precisions to measure: fp32, fp24, fp16; default: all, or, with --era, "
                     "the precision of the chip")
    sub.add_argument("--rays", type=count_word, default=1 << 14, metavar="N",
                     help=f"largest number of rays of each kind ({', '.join(KINDS)}); default "
                     "%(default)s")
    sub.add_argument("--size", type=size_word, default=(256, 256), metavar="WIDTHxHEIGHT",
                     help="size of the pictures that are compared; default 256x256")
    sub.add_argument("--seed", type=int, default=0,
                     help="seed of the random rays; default %(default)s")
    sub.add_argument("-o", "--output", metavar="FILE.json", help="write the JSON to a file, too")
    add_options(sub)
    sub = command("tune", _tune, "find the fastest method and options within bounds on the errors")
    sub.add_argument("scene", help="a scene's name or a mesh file")
    sub.add_argument("--max-wrong", type=float, required=True, metavar="SHARE",
                     help="bound on the share of rays with a wrong hit or miss, for example 1e-5; "
                     "the upper 95 %% confidence bound of the measured share must not exceed it")
    sub.add_argument("--max-t-error", type=float, required=True, metavar="RATIO",
                     help="bound on the relative error of t, for example 1e-5")
    sub.add_argument("--t-quantile", type=float, default=0.999, metavar="SHARE",
                     help="share of the right hits whose t must keep the bound --max-t-error; "
                     "default %(default)s")
    sub.add_argument("--max-bytes", type=int, metavar="N",
                     help="bound on the bytes of textures with 512 x 512 rays in flight; tune "
                     "then chooses one method for all rays, because the data of two methods "
                     "would be in memory at once")
    sub.add_argument("--rays", type=count_word, metavar="N", help="number of rays that test the "
                     "bounds, and of new rays that confirm the result; default: the number that a "
                     "proof of the bounds needs, which replaces a smaller N")
    sub.add_argument("--kinds", type=names, default=list(KINDS), metavar="NAME,NAME,...",
                     help="kinds of rays for which the bounds must hold, in equal shares; default "
                     f"{','.join(KINDS)}")
    sub.add_argument("--seed", type=whole_word, default=0,
                     help="seed of the random rays; default %(default)s")
    sub.add_argument("--budget", type=seconds_word, default=300.0, metavar="SECONDS",
                     help="time for trying candidates; half of it is for coherent rays; default "
                     "%(default)s")
    add_methods(sub, "all")
    sub.add_argument("-o", "--output", metavar="SETTINGS.json",
                     help="write the settings to a file, too")


def _facts(scene: Scene) -> dict[str, Any]:
    return {**scene.facts(), "scene": settings.describe(scene)}


# accuracy ------------------------------------------------------------------------------------

_COLUMNS = {
    ("method", "precision"): "",
    ("rays",): "number of judged rays, of all kinds together",
    ("wrong share",): "share of rays with a leak, a false hit, a wrong triangle or an unfinished "
    "search",
    ("at most (95 %)",): "upper 95 % confidence bound of the share of wrong rays",
    ("leak",): "number of rays that pass through a surface without a hit",
    ("false",): "number of rays with a hit of a triangle that the ray cannot hit",
    ("triangle",): "number of rays whose hit is behind another triangle that the ray surely hits",
    ("unfinished",): "number of rays that the step cap or a full stack stopped",
    ("excused",): "number of rays whose triangle differs from the reference's within float32's "
    "error bound; they do not count as wrong",
    ("t past bound",): "number of rays whose error of t exceeds the error bound of the watertight "
    "test in float32",
    ("t ulp 50 %", "99.9 %", "max"): "median, quantile and maximum of the error of t over the "
    "right hits, in units in the last place",
    ("u, v max",): "largest error of a barycentric coordinate",
    ("RMSE", "FLIP"): "error of a picture with shadows; 0 if the picture equals the reference's. "
    "The picture can differ although no ray is wrong, because of excused rays, or of shadow rays, "
    "which the other columns do not judge",
    ("Mrays/s", "ms"): f"rate and time of the passes alone, for the judged rays; median of {RUNS} "
    "calls for each kind. Few rays cannot fill the renderer: measure rates by `gpgpu-rt bench`",
    ("MB",): "size of all textures, including rays and hits",
    ("passes",): "number of passes for the judged rays"}


def _accuracy(chosen: argparse.Namespace) -> None:
    if chosen.output:
        check_writable(chosen.output)
    scene, given = load_scene(chosen.scene), given_options(chosen)
    rows = accuracy(scene, chosen.methods, chosen.precisions, given, chosen.rays,
                    chosen.size, chosen.seed, say)
    gpu = open_gpu(given.get("context"))
    result = {**_facts(scene), **run_facts(gpu, chosen.command), "seed": chosen.seed, "rows": rows,
              "flip_note": flip_note()}
    if chosen.output:
        with replacing(chosen.output) as path:
            path.write_text(json.dumps(result, indent=1, default=str) + "\n", encoding="utf-8")
    print_stand_in(scene, chosen.json)
    if chosen.json:
        return print_json(result)
    print(f"{scene.name}, {len(scene):,} triangles; up to {chosen.rays:,} rays of each kind: "
          f"{', '.join(KINDS)}; pictures of {chosen.size[0]} x {chosen.size[1]} pixels")
    print_table([head for heads in _COLUMNS for head in heads],
                [_accuracy_line(row) for row in rows])
    print()
    for heads, meaning in _COLUMNS.items():
        if meaning:
            print(f"{', '.join(heads)}: {meaning}")
    if flip_note():
        print(flip_note())
    if chosen.output:
        print(f"wrote {chosen.output}")


def _accuracy_line(row: dict[str, Any]) -> list[str]:
    score, image = row["all"], row["image"] or {}
    ulps = score["t_ulps"] or {}
    counts = score["counts"]
    return [row["method"], row["precision"], f"{score['rays']:,}", number(score["wrong_share"], 2),
            number(score["upper_95"], 2), *(str(counts[name]) for name in WRONG),
            str(counts[WITHIN_BOUND]), str(counts["wrong distance"]),
            *(number(ulps.get(name), 2) for name in ("median", "99.9 %", "max")),
            number((score["barycentric"] or {}).get("max"), 2), number(image.get("rmse"), 2),
            number(image.get("flip"), 2), number(score["rays_per_second"] / 1e6),
            f"{score['seconds'] * 1e3:.0f}", f"{row['texture_bytes'] / 1e6:.1f}",
            str(score["passes"])]


# tune ----------------------------------------------------------------------------------------


def _tune(chosen: argparse.Namespace) -> None:
    if chosen.output:
        check_writable(chosen.output)
    promise = Promise(chosen.max_wrong, chosen.max_t_error, chosen.max_bytes, chosen.t_quantile,
                      tuple(chosen.kinds))
    scene = load_scene(chosen.scene)
    found = tune(scene, promise, chosen.rays, chosen.seed, chosen.budget, chosen.methods,
                 say)
    kept = None
    if found.settings is not None:
        kept = settings.store(found.settings)
        if chosen.output:
            found.settings.save(chosen.output)
    if found.settings is not None and kept is None:
        say("not saved for method auto, because no cache folder can be written; "
            + (f"use --settings {chosen.output}" if chosen.output else
               "write the settings to a file by -o"))
    print_stand_in(scene, chosen.json)
    if chosen.json:
        print_json({**_facts(scene), **found.to_dict()})
    else:
        for search in found.searches:
            _print_search(search)
        if kept is not None:
            print(f"saved for method auto: {kept}")
        if chosen.output and found.settings is not None:
            print(f"wrote {chosen.output}")
    if found.settings is None:
        sys.stdout.flush()
        raise Error(_unreachable(found.searches[-1]))


def _print_search(found: Search) -> None:
    promise = found.promise
    if found.rays_of != ALL:
        print(f"\nfor {found.rays_of} rays, timed on {OWN_KIND[found.rays_of]} rays")
    print_table(("candidate", "Mrays/s", "rays timed", "rays judged", "wrong share",
                 "at most (95 %)", f"t error at {promise.t_quantile:g}", "MB", "outcome"),
                [_trial_line(trial) for trial in found.trials])
    print(f"\nRays: equal shares of {', '.join(promise.kinds)}. MB: textures with 512 x 512 rays "
          "in flight.\nThe decision uses two upper 95 % confidence bounds: the bound of the share "
          f"of wrong rays, and the bound of\nthe {promise.t_quantile:g} quantile of the relative "
          "error of t over the right hits.")
    for note in found.notes:
        print(note)
    if found.chosen is not None:
        trial = found.chosen
        print(f"chosen{_for(found)}: {trial.candidate}, "
              f"{number(trial.rays_per_second / 1e6)} Mrays/s, {trial.note}")


def _trial_line(trial: Trial) -> list[str]:
    finding, timed = trial.finding, [size for size in trial.rates if size <= SCREEN]
    rate = [number(trial.rates[max(timed)] / 1e6), f"{max(timed):,}"] if timed else ["-"] * 2
    judged = ["-"] * 4 if finding is None else [
        f"{finding.score.rays:,}", number(finding.score.wrong_share, 2),
        number(finding.score.upper_95, 2), number(finding.t_error, 2)]
    return [str(trial.candidate), *rate, *judged, f"{trial.texture_bytes / 1e6:.1f}",
            f"{trial.outcome}: {trial.note}".rstrip(": ")]


def _for(found: Search) -> str:
    return "" if found.rays_of == ALL else f" for {found.rays_of} rays"


def _unreachable(found: Search) -> str:
    closest, late = found.closest, LATE in found.notes
    if closest is None:
        return (f"the time ran out before any candidate was judged{_for(found)}; give more time "
                "with --budget" if late else "no candidate could be tried; give other methods")
    return (f"no candidate {'that was tried ' if late else ''}keeps the bounds{_for(found)}; the "
            f"closest is {closest.candidate}: {closest.note}; "
            + ("give more time with --budget, or " if late else "") + "relax the bounds")
