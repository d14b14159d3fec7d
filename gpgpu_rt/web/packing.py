"""Packing: packs float32 tables into short texts, from which the page recovers the same bits.

A row holds 1 to MOST_TEXELS texels; the number that packs best is chosen. Each component of a row
is a column. Each value is predicted, and its difference from the prediction is stored. Byte plane
k of a column holds byte k of its differences, because such planes compress well. `unpack.js`
reverses these steps.
"""
from __future__ import annotations

import base64
import zlib
from typing import Any

import numpy as np

# The predictions of a number in a column, in this order: 0, the previous number, the index of the
# number's row, and 1 + the largest previous number.
PREDICTIONS = ("none", "previous", "row", "fresh")
MOST_TEXELS = 4
SAMPLE = 1 << 13    # number of rows from which the prediction of a column is chosen
# The rows of a column can be divided into classes, each with its own kind and prediction. A row's
# class is the value of another column, the key; values above CLASSES count as CLASSES.
CLASSES = 3


def packed_table(values: np.ndarray) -> dict[str, Any]:
    """Return values, (n, components) or (n,) float32, as a description for JSON.

    Returns
    -------
    dict
        "values" and "width": how many values and columns exist. "data": the bytes of all columns,
        compressed by raw deflate, as base64. "columns": [number, codes] of each column, in the
        order of "data". The codes are [kind, prediction, number of byte planes]. If a key divides
        the column into classes, they are [key column, last class, a list of the codes of each
        class].
    """
    flat = np.ascontiguousarray(values, "<f4").ravel()
    components = 1 if np.ndim(values) == 1 else np.shape(values)[1]
    columns = min((_Columns(flat, components * texels) for texels in range(1, MOST_TEXELS + 1)),
                  key=lambda one: one.cost)
    told, parts = columns.codes()
    return {"values": flat.size, "width": columns.table.shape[1], "columns": told,
            "data": _text(b"".join(parts))}


class _Columns:
    """A table with ``width`` columns. Each column has the codes that pack SAMPLE of its rows best.

    Attributes
    ----------
    table : (rows, width) float32. Zeros complete the last row
    cost : bytes of the packed table, estimated from the samples
    """

    def __init__(self, flat: np.ndarray, width: int) -> None:
        self.table = np.zeros((-(-flat.size // width), width), "<f4")
        self.table.ravel()[:flat.size] = flat
        first = max(0, (len(self.table) - SAMPLE) // 2)
        sample = self.table[first:first + SAMPLE]
        rows = np.arange(first, first + len(sample))
        self._codes: dict[int, Any] = {}
        self.cost = 0.0
        plain = [_cheapest(sample[:, k], rows) for k in range(width)]
        keys = [k for k in range(width) if _exact_integers(self.table[:, k])]
        for k, (cost, codes) in enumerate(plain):
            for key in keys:
                # A key must not itself be divided, because the page decodes the keys first.
                if key != k and not isinstance(self._codes.get(key, [""])[0], int):
                    divided = _divided(sample[:, k], sample[:, key], rows)
                    if divided[0] < 0.97 * cost:
                        cost, codes = divided[0], [key, CLASSES, divided[1]]
            if any(isinstance(one[0], int) and one[0] == k for one in self._codes.values()):
                cost, codes = plain[k]      # column k is a key, which must not be divided
            self._codes[k] = codes
            self.cost += cost * len(self.table) / max(len(sample), 1)

    def codes(self) -> tuple[list[Any], list[bytes]]:
        """Return [number, codes] and the bytes of each column, undivided columns first."""
        told, parts, rows = [], [], np.arange(len(self.table))
        for k in sorted(self._codes, key=lambda k: isinstance(self._codes[k][0], int)):
            codes, column = self._codes[k], self.table[:, k]
            if isinstance(codes[0], int):
                key, last, each = codes
                classes = _classes(self.table[:, key])
                found = [_coded(column[classes == c], rows[classes == c], *one[:2])
                         for c, one in enumerate(each)]
                told.append([k, [key, last, [one for one, _ in found]]])
                parts += [data for _, data in found]
            else:
                one, data = _coded(column, rows, *codes[:2])
                told.append([k, one])
                parts.append(data)
        return told, parts


def _cheapest(column: np.ndarray, rows: np.ndarray) -> tuple[int, list[Any]]:
    """Return the smallest number of compressed bytes for a column, and its codes."""
    kinds = ["integer", "float"] if _exact_integers(column) else ["float"]
    tried = []
    for kind in kinds:
        for prediction in PREDICTIONS if kind == "integer" else PREDICTIONS[:2]:
            codes, data = _coded(column, rows, kind, prediction)
            tried.append((len(zlib.compress(data, 1)), codes))
    return min(tried, key=lambda one: one[0])


def _divided(column: np.ndarray, key: np.ndarray, rows: np.ndarray) -> tuple[int, list[Any]]:
    classes = _classes(key)
    found = [_cheapest(column[classes == c], rows[classes == c]) for c in range(CLASSES + 1)]
    return sum(cost for cost, _ in found), [codes for _, codes in found]


def _classes(key: np.ndarray) -> np.ndarray:
    return np.clip(key, 0, CLASSES).astype(np.int64)


def _exact_integers(column: np.ndarray) -> bool:
    """Return whether a column holds only integers from -2^24 to 2^24, and no -0."""
    if not (np.abs(column) <= 1 << 24).all():   # also false for NaN
        return False
    return bool((column.astype(np.int32).astype("<f4").view("<u4") == column.view("<u4")).all())


def _coded(column: np.ndarray, rows: np.ndarray, kind: str,
           prediction: str) -> tuple[list[Any], bytes]:
    """Return a column's codes, and the byte planes of its differences, lowest byte first."""
    column = np.ascontiguousarray(column)
    if kind == "integer" and not _exact_integers(column):
        kind, prediction = "float", "none"      # the sample held integers, but not all rows do
    if kind == "integer":
        numbers = column.astype(np.int32)
    else:
        # Turn the bits into integers in the order of the floats: near floats give near integers.
        bits = column.view("<i4")
        numbers = bits ^ ((bits >> 31) & 0x7fffffff)
    if prediction == "fresh":
        # The code 0 stands for 1 + the largest previous number.
        tops = np.maximum.accumulate(np.concatenate([[-1], numbers]))[:-1]
        if numbers.size and numbers.min() < -1:
            return _coded(column, rows, kind, "none")
        codes = np.where(numbers == tops + 1, 0, numbers + 2).astype("<u4")
    else:
        base = {"none": 0, "row": rows, "previous": np.concatenate([[0], numbers[:-1]])
                if numbers.size else 0}[prediction]
        steps = (numbers - np.asarray(base)).astype(np.int64).astype(np.int32)  # modulo 2^32
        codes = ((steps << 1) ^ (steps >> 31)).view("<u4").astype("<u4")
    largest = int(codes.max(initial=0))
    planes = (largest.bit_length() + 7) // 8
    data = codes.view(np.uint8).reshape(-1, 4).T[:planes]
    return [kind, prediction, planes], np.ascontiguousarray(data).tobytes()


def _text(data: bytes) -> str:
    deflate = zlib.compressobj(6, zlib.DEFLATED, -15)
    return base64.b64encode(deflate.compress(data) + deflate.flush()).decode()
