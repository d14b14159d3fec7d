"""Mutations: random changes to the bytes of a file, to JSON values, and to arrays."""
from __future__ import annotations

import json
import re
import warnings
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

NUMBER = re.compile(rb"-?\d+(?:\.\d+)?(?:e-?\d+)?")
NUMBERS = (b"0", b"-1", b"1", b"255", b"65536", b"2147483647", b"-2147483648", b"4294967296",
           b"99999999999999999999", b"1e9", b"1e38", b"1e39", b"1e308", b"1e999", b"nan", b"inf",
           b"-0.0", b"1e-45", b"x", b"", b"0x10", b"1" * 400)
WORDS = (b" " * 5000, b"[" * 3000, b"{" * 3000, b"\xe9", b"\xff\xfe", b"\0", b"\n\n", b"\\\n",
         b"//", b"../", b"/dev/zero", b"%s%n", b"\r", b'"', b"element face 100000000\n",
         b"usemtl a\n", b"o \xc3\n", b"f 1 2 3\n", b"f -1 -2 -3 -4\n", b"solid", b"endsolid")
VALUES = (None, True, False, 0, -1, 1, 2 ** 31, 2 ** 63, 10 ** 40, 1e-300, 1e30, 1e308,
          float("inf"), float("nan"), "", "x", "a.png", "../a.png", ".", "/", "\0", "\ud800",
          "x" * 5000, [], {}, [[]], [0, 0, 0], [1e30, -1e30, 1], [float("nan")] * 3, ["x"] * 3,
          [1] * 5000, {"x": {}}, 0.5)
Rng = np.random.Generator


def mutated(content: bytes, rng: Rng) -> bytes:
    """Return the bytes with one to three changes, cut to at most 1 MiB."""
    for _ in range(int(rng.choice([1, 1, 1, 2, 3]))):
        content = _CHANGES[int(rng.integers(len(_CHANGES)))](content, rng)
    return content[:1 << 20]


def mutated_json(content: bytes, rng: Rng) -> bytes:
    """Return JSON with one to three changed values, keys or items. In a quarter of the cases,
    change bytes instead."""
    if rng.random() < 0.25:
        return mutated(content, rng)
    value = json.loads(content)
    for _ in range(int(rng.choice([1, 1, 1, 2, 3]))):
        value = _changed(value, rng)
    return json.dumps(value).encode()


def mutated_arrays(arrays: dict[str, np.ndarray], rng: Rng) -> dict[str, np.ndarray]:
    """Return the arrays with one or two changes of values, shape, type or name."""
    arrays = {name: np.array(values) for name, values in arrays.items()}
    for _ in range(int(rng.integers(1, 3))):
        if not arrays:
            break
        name = sorted(arrays)[int(rng.integers(len(arrays)))]
        arrays[name] = _ARRAY_CHANGES[int(rng.integers(len(_ARRAY_CHANGES)))](arrays[name], rng)
        if rng.random() < 0.05:
            arrays["other"] = arrays.pop(name)
    return arrays


def _span(content: bytes, rng: Rng, most: int = 64) -> tuple[int, int]:
    first = int(rng.integers(len(content) + 1))
    return first, min(len(content), first + int(rng.integers(1, most + 1)))


def _flip(content: bytes, rng: Rng) -> bytes:
    found = bytearray(content)
    for at in rng.integers(0, max(len(found), 1), int(rng.integers(1, 9))).tolist():
        if at < len(found):
            found[at] ^= 1 << int(rng.integers(8))
    return bytes(found)


def _random(content: bytes, rng: Rng) -> bytes:
    first, last = _span(content, rng, 8)
    return content[:first] + rng.bytes(last - first) + content[last:]


def _extreme(content: bytes, rng: Rng) -> bytes:
    first, _ = _span(content, rng)
    word = (b"\xff\xff\xff\xff", b"\0\0\0\0", b"\xff\xff\xff\x7f", b"\0\0\xc0\x7f",
            b"\x00\xe1\xf5\x05", b"\0\0\0\x80")[int(rng.integers(6))]
    return content[:first] + word + content[first + 4:]


def _cut(content: bytes, rng: Rng) -> bytes:
    first, last = _span(content, rng, 256)
    return content[:first] if rng.random() < 0.4 else content[:first] + content[last:]


def _repeat(content: bytes, rng: Rng) -> bytes:
    first, last = _span(content, rng)
    times = int(rng.choice([2, 10, 300]))
    return content[:first] + content[first:last] * times + content[last:]


def _insert(content: bytes, rng: Rng) -> bytes:
    first, _ = _span(content, rng)
    return content[:first] + WORDS[int(rng.integers(len(WORDS)))] + content[first:]


def _number(content: bytes, rng: Rng) -> bytes:
    found = list(NUMBER.finditer(content[:20000]))
    if not found:
        return _random(content, rng)
    one = found[int(rng.integers(len(found)))]
    return content[:one.start()] + NUMBERS[int(rng.integers(len(NUMBERS)))] + content[one.end():]


def _lines(content: bytes, rng: Rng) -> bytes:
    lines = content.split(b"\n")
    one, two = rng.integers(0, len(lines), 2).tolist()
    if rng.random() < 0.5:
        lines[one], lines[two] = lines[two], lines[one]
    else:
        lines.insert(one, lines[two])
    return b"\n".join(lines)


_CHANGES: Sequence[Callable[[bytes, Rng], bytes]] = (
    _flip, _random, _extreme, _cut, _repeat, _insert, _number, _number, _lines)


def _changed(value: Any, rng: Rng) -> Any:
    if isinstance(value, dict) and value and rng.random() < 0.85:
        name = sorted(value)[int(rng.integers(len(value)))]
        chance = rng.random()
        if chance < 0.1:
            return {k: v for k, v in value.items() if k != name}
        if chance < 0.2:
            return {**value, str(_value(rng)): value[name]}
        return {**value, name: _changed(value[name], rng)}
    if isinstance(value, list) and value and rng.random() < 0.7:
        at = int(rng.integers(len(value)))
        chance = rng.random()
        if chance < 0.15:
            return value[:at] + value[at + 1:]
        if chance < 0.3:
            return value[:at] + [value[at]] * int(rng.choice([2, 50])) + value[at:]
        return value[:at] + [_changed(value[at], rng)] + value[at + 1:]
    return _value(rng)


def _value(rng: Rng) -> Any:
    return VALUES[int(rng.integers(len(VALUES)))]


def _values(array: np.ndarray, rng: Rng) -> np.ndarray:
    if not array.size or array.dtype.kind not in "fiub":
        return array
    flat = array.reshape(-1)
    at = rng.integers(0, len(flat), int(rng.integers(1, 6)))
    with np.errstate(all="ignore"):
        if array.dtype.kind == "f":
            flat[at] = rng.choice([np.nan, np.inf, -np.inf, 0, 1e-45, 3e38, -1, 1e300], len(at))
        else:
            flat[at] = rng.choice([0, 1, -1, 7, 100, 127, len(flat)], len(at)).astype(array.dtype)
    return array


def _shape(array: np.ndarray, rng: Rng) -> np.ndarray:
    chosen = int(rng.integers(7))
    if chosen == 6 or not array.ndim or not len(array):
        return array[None]
    return (array[:-1], array[:0], array.T, np.concatenate([array, array]), array[0],
            array.reshape(-1))[chosen]


def _type(array: np.ndarray, rng: Rng) -> np.ndarray:
    kind = str(rng.choice(["f2", "f4", "f8", "i1", "i4", "i8", "u8", "b1", "c8", "S3", "U3",
                           "M8[s]", ">f4", "V4"]))
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return array.astype(kind)
        except (TypeError, ValueError, RuntimeError):
            return array.astype("f8") if array.dtype.kind in "fiub" else array


_ARRAY_CHANGES: Sequence[Callable[[np.ndarray, Rng], np.ndarray]] = (_values, _values, _shape,
                                                                     _type)
