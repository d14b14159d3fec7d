"""Tokens: the words of an AFF file (BART's format), in order; errors name file and line."""
from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from itertools import chain
from typing import Any

import numpy as np

from ...disk.files import decoded
from ...errors import SceneError
from ...text_format import shortened

LONGEST = 64        # largest number of characters of a number; longer numbers are errors
_COMMENT = re.compile(rb"[#%][^\n]*")


class Tokens:
    """The words of a file without its comments. A brace is a separate word.

    Parameters
    ----------
    content : the file's content
    name : the name of the file, for error messages

    Attributes
    ----------
    at : index of the next word
    """

    def __init__(self, content: bytes, name: str) -> None:
        text = content.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
        text = _COMMENT.sub(b"", text).replace(b"{", b" { ").replace(b"}", b" } ")
        self._text, self.name = text, name
        self._words = text.split()
        self.at = 0

    @property
    def peek(self) -> bytes:
        """The next word, without consuming it; empty at the end of the file."""
        return self._words[self.at] if self.at < len(self._words) else b""

    def word(self, what: str) -> bytes:
        """Return the next word, which error messages call ``what``."""
        found = self.peek
        if not found:
            raise self.error(f"expected {what}, but the file ends")
        self.at += 1
        return found

    def text(self, what: str) -> str:
        """Return the next word as text, such as the name of a file."""
        return decoded(self.word(what))

    def expect(self, *words: str) -> str:
        """Return the next word, which must be one of ``words``."""
        found = self.text(" or ".join(words))
        if found not in words:
            raise self.error(f"expected {' or '.join(words)}, but found {shortened(found)}",
                             self.at - 1)
        return found

    def count(self, what: str, width: int) -> int:
        """Return the next word, the number of the items that follow (``what`` names these items).
        Raise SceneError if fewer than ``width`` words per item follow."""
        number = int(self.wholes(self.take(1, f"the number of {what}"))[0])
        left = len(self._words) - self.at
        if number < 0:
            raise self.error(f"declares {number:,} {what}; give 0 or more", self.at - 1)
        if number * width > left:
            raise self.error(f"declares {number:,} {what}, but only {left:,} words follow",
                             self.at - 1)
        return number

    def take(self, count: int, what: str) -> range:
        """Return the indices of the next ``count`` words, and consume them."""
        first = self.at
        if first + count > len(self._words):
            raise self.error(f"expected {what}, but the file ends", len(self._words))
        self.at += count
        return range(first, self.at)

    def floats(self, *places: range) -> np.ndarray:
        """Return the words with these indices as finite numbers, (n,) float64."""
        found = self._numbers(float, np.float64, places)
        if not np.isfinite(found).all():
            k = int(np.argmin(np.isfinite(found)))
            at = next(at for i, at in enumerate(chain(*places)) if i == k)
            raise self.error(f"{self._shown(at)} is not finite", at)
        return found

    def wholes(self, *places: range) -> np.ndarray:
        """Return the words with these indices as whole numbers, (n,) int64."""
        return self._numbers(int, np.int64, places)

    def numbers(self, count: int, what: str) -> np.ndarray:
        """Return the next ``count`` words as finite numbers, (count,) float64."""
        return self.floats(self.take(count, what))

    def _numbers(self, kind: Callable[[bytes], Any], dtype: type,
                 places: tuple[range, ...]) -> np.ndarray:
        count = sum(map(len, places))
        try:
            if max(map(len, self._words_of(places)), default=0) <= LONGEST:
                return np.fromiter(map(kind, self._words_of(places)), dtype, count)
        except (ValueError, OverflowError):
            pass
        raise self._first_wrong(kind, dtype, places)

    def _words_of(self, places: tuple[range, ...]) -> Iterator[bytes]:
        return chain.from_iterable(self._words[place.start:place.stop] for place in places)

    def _first_wrong(self, kind: Callable[[bytes], Any], dtype: type,
                     places: tuple[range, ...]) -> SceneError:
        """Return the error of the first word that is no number."""
        named = "number" if kind is float else "whole number"
        for at in chain(*places):
            try:
                if len(self._words[at]) <= LONGEST:
                    dtype(kind(self._words[at]))
                    continue
            except (ValueError, OverflowError):
                pass
            return self.error(f"{self._shown(at)} is no {named}", at)
        return self.error(f"a word is no {named}")

    def _shown(self, at: int) -> str:
        return shortened(decoded(self._words[at][:80]))

    def line(self, at: int) -> int:
        """Return the line number of a word, counted from 1; the last line if there is no such
        word."""
        for k, found in enumerate(re.finditer(rb"\S+", self._text)):
            if k == at:
                return self._text.count(b"\n", 0, found.start()) + 1
        return self._text.rstrip().count(b"\n") + 1

    def error(self, message: str, at: int | None = None) -> SceneError:
        """Return an error that names the line of a word, by default of the next word."""
        return SceneError(f"{self.name}, line {self.line(self.at if at is None else at)}: "
                          f"{message}")
