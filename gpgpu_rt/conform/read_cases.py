"""Reads a family of the conformance suite and judges answers to its rays. Needs only Python.

    python read_cases.py FAMILY.json ANSWERS.json

ANSWERS.json is an object with the lists "triangle" (-1 or null for a miss) and, optionally, "t".
"""
import json
import sys


def load(path):
    with open(path) as file:
        return json.load(file)


def judge(family, triangles, ts=None):
    """Return for each ray "right", "leak", "wrong triangle" or "wrong t"."""
    verdicts = []
    for ray, triangle in enumerate(triangles):
        if triangle is None or triangle < 0:
            verdicts.append("leak" if family["must_hit"][ray] else "right")
            continue
        same = family["copy_of"][triangle] if triangle < len(family["copy_of"]) else -1
        ranges = [(low, high) for one, low, high in family["acceptable"][ray] if one == same]
        if not ranges:
            verdicts.append("wrong triangle")
        elif ts is None or any(low <= (ts[ray] or 0) <= high for low, high in ranges):
            verdicts.append("right")
        else:
            verdicts.append("wrong t")
    return verdicts


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    family, answers = load(sys.argv[1]), load(sys.argv[2])
    if len(answers["triangle"]) != len(family["origins"]):
        sys.exit(f"{len(answers['triangle'])} answers for {len(family['origins'])} rays; "
                 "give an answer for each ray")
    found = judge(family, answers["triangle"], answers.get("t"))
    print({kind: found.count(kind) for kind in sorted(set(found))})
