"""Conditionals of GLSL: evaluates ``#if`` and related directives like a preprocessor."""
from __future__ import annotations

import operator
import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass

from ..errors import ShaderError

_DIRECTIVE = re.compile(r"\s*#\s*(?P<word>\w+)(?P<rest>.*)")
_DEFINE = re.compile(r"\s*(?P<name>\w+)(?P<parameters>\([^)]*\))?(?P<value>.*)")
_TOKEN = re.compile(r"\s*(?:(\w+)|(&&|\|\||[=!<>]=|[-+*/%<>!()]))")
_MOST_EXPANSIONS = 100      # per condition: a macro that names itself would expand forever

# operator -> (precedence, function)
_OPERATORS: Mapping[str, tuple[int, Callable[[int, int], int]]] = {
    "||": (1, lambda a, b: a or b), "&&": (2, lambda a, b: a and b),
    "==": (3, operator.eq), "!=": (3, operator.ne),
    "<": (4, operator.lt), ">": (4, operator.gt), "<=": (4, operator.le), ">=": (4, operator.ge),
    "+": (5, operator.add), "-": (5, operator.sub),
    "*": (6, operator.mul), "/": (6, operator.floordiv), "%": (6, operator.mod)}


@dataclass
class _Group:
    """An ``#if`` whose ``#endif`` has not been read yet.

    Attributes
    ----------
    start : number of lines kept before the ``#if``
    in_force : whether the branch being read is compiled
    decided : whether a branch was compiled, so that later branches are skipped
    """

    start: int
    in_force: bool
    decided: bool


def lines_in_force(lines: Sequence[str], defined: Collection[str] = ()) -> list[int]:
    """Return the indices of the lines that a compiler sees, without conditional directives. If no
    line of a conditional is compiled, the comment directly above the ``#if`` is omitted, too.

    Parameters
    ----------
    lines : a program's text with resolved includes
    defined : names that the compiler defines, such as ``GL_ARB_gpu_shader5``

    Raises
    ------
    ShaderError
        for a condition that is not an expression, or for unmatched conditionals
    """
    macros = dict.fromkeys(defined, "1")
    kept: list[int] = []
    groups: list[_Group] = []
    at = 0
    while at < len(lines):
        end = at + 1
        while lines[end - 1].endswith("\\") and end < len(lines):
            end += 1
        found = _DIRECTIVE.match(lines[at])
        word, rest = "", ""
        if found:
            rest = " ".join([found["rest"], *lines[at + 1:end]]).replace("\\", " ")
            word, rest = found["word"], rest.partition("//")[0]
        compiled = all(group.in_force for group in groups)
        if word in ("if", "ifdef", "ifndef"):
            holds = compiled and _holds(word, rest, macros)
            groups.append(_Group(len(kept), holds, holds))
        elif word in ("elif", "else", "endif"):
            if not groups:
                raise ShaderError(f"#{word} without #if in a program's text")
            group = groups.pop()
            if word == "endif":
                _leave_out_empty(lines, kept, group.start)
            else:
                holds = (not group.decided and all(outer.in_force for outer in groups)
                         and (word == "else" or _holds("if", rest, macros)))
                groups.append(_Group(group.start, holds, group.decided or holds))
        elif compiled:
            if word == "define" and (macro := _DEFINE.match(rest)):
                macros[macro["name"]] = macro["value"].strip()
            elif word == "undef":
                macros.pop(rest.strip(), None)
            kept.extend(range(at, end))
        at = end
    if groups:
        raise ShaderError("#if without #endif in a program's text")
    return kept


def switches(lines: Sequence[str]) -> set[str]:
    """Return the macros that conditionals test."""
    found = [_DIRECTIVE.match(line) for line in lines]
    return {name for one in found if one and one["word"] in ("if", "elif", "ifdef", "ifndef")
            for name in re.findall(r"[A-Za-z_]\w*", one["rest"].partition("//")[0])} - {"defined"}


def _leave_out_empty(lines: Sequence[str], kept: list[int], start: int) -> None:
    """Remove a group without compiled lines, and the comment above it."""
    if any(lines[at].strip() for at in kept[start:]):
        return
    del kept[start:]
    while kept and lines[kept[-1]].lstrip().startswith("//"):
        kept.pop()


def _holds(word: str, rest: str, macros: Mapping[str, str]) -> bool:
    if word == "if":
        return bool(_Expression(rest, macros).value())
    return (rest.strip() in macros) == (word == "ifdef")


class _Expression:
    """A condition of ``#if``. Operators of equal precedence are evaluated from left to right. A
    name that is no macro is 0."""

    def __init__(self, text: str, macros: Mapping[str, str]) -> None:
        self._text, self._macros = text.strip(), macros
        self._expansions = 0
        self._tokens = self._read(text)

    def value(self) -> int:
        found = self._operation(1)
        if self._tokens:
            raise self._wrong()
        return found

    def _wrong(self) -> ShaderError:
        return ShaderError(f"cannot evaluate #if {self._text}")

    def _read(self, text: str) -> list[str]:
        tokens, at = [], 0
        text = text.rstrip()
        while at < len(text):
            found = _TOKEN.match(text, at)
            if found is None:
                raise self._wrong()
            tokens.append(found[1] or found[2])
            at = found.end()
        return tokens

    def _next(self) -> str:
        if not self._tokens:
            raise self._wrong()
        return self._tokens.pop(0)

    def _operation(self, least: int) -> int:
        """Evaluate an operand and the following operators of precedence ``least`` or higher."""
        left = self._operand()
        while self._tokens and _OPERATORS.get(self._tokens[0], (0,))[0] >= least:
            level, compute = _OPERATORS[self._tokens.pop(0)]
            right = self._operation(level + 1)
            try:
                left = int(compute(left, right))
            except ZeroDivisionError:
                raise self._wrong() from None
        return left

    def _operand(self) -> int:
        token = self._next()
        if token == "!":
            return int(not self._operand())
        if token in "+-":
            return self._operand() * (-1 if token == "-" else 1)
        if token == "(":
            found = self._operation(1)
            self._expect(")")
            return found
        if token == "defined":
            name = self._next()
            if name == "(":
                name = self._next()
                self._expect(")")
            return int(name in self._macros)
        if token in self._macros:
            self._expansions += 1
            if self._expansions > _MOST_EXPANSIONS:
                raise self._wrong()
            self._tokens[:0] = self._read(self._macros[token])
            return self._operand()
        if token[0].isdigit():
            try:
                return int(token.rstrip("uU"), 0)
            except ValueError:
                raise self._wrong() from None
        if not token.isidentifier():
            raise self._wrong()
        return 0

    def _expect(self, token: str) -> None:
        if self._next() != token:
            raise self._wrong()
