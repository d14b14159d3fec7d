"""Selections: writes `a ? b : c`, `&&` and `||` as calls, so that ANGLE makes no branch.

ANGLE translates `a ? b : c`, `a && b` and `a || b` into a branch, unless b and c are plain names
or constants. Each branch in a loop doubles the time and memory that SwiftShader needs for the
loop. The reason is SwiftShader's search for back edges (`Spirv::Function::ExistsPath`), which
queues each block once for every path to the block. Within `picked_value(a, b, c)`, arguments are
plain names, so a call makes no branch.

A selection (one of these expressions) is rewritten only if computing both of its values is always
harmless. Such values assign nothing, call no function with an effect or a loop, and read no array
outside its bounds. Only a function's parameter counts as an index inside the bounds. Programs pass
only indices of rays or axes as such parameters, and these indices lie inside the array.
"""
from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

_VALUES = ("float", "int", "uint", "bool")
TYPES = (*_VALUES, *(f"{kind}vec{size}" for kind in ("", "i", "u", "b") for size in (2, 3, 4)))
# FUNCTIONS is one line, so that the program's other lines keep their numbers.
FUNCTIONS = " ".join(
    [f"{kind} picked_value(bool a, {kind} b, {kind} c) {{ return a ? b : c; }}" for kind in TYPES]
    + ["bool both_hold(bool a, bool b) { return a && b; }",
       "bool either_holds(bool a, bool b) { return a || b; }"])
BUILT_IN = frozenset((*TYPES, *"""
    abs sign floor ceil fract trunc round roundEven mod min max clamp mix step sqrt inversesqrt pow
    exp exp2 log log2 sin cos tan asin acos atan dot cross length distance normalize any all not
    lessThan lessThanEqual greaterThan greaterThanEqual equal notEqual isnan isinf floatBitsToInt
    floatBitsToUint intBitsToFloat uintBitsToFloat textureSize texture texelFetch""".split()))

_TOKEN = re.compile(r"^[ \t]*#(?:\\\n|[^\n])*|\n|[ \t\r]+|//[^\n]*|"
                    r"\w[\w.]*|\+\+|--|&&|\|\||\^\^|<<=|>>=|<<|>>|[-+*/%&|^=!<>]=|.", re.M | re.S)
_CLOSING = {"(": ")", "[": "]", "{": "}"}
_ASSIGNING = {"=", "+=", "-=", "*=", "/=", "%=", "&=", "|=", "^=", "<<=", ">>="}
_ENDS = {";", ",", "return", "else", *_ASSIGNING}
_CHANGING = {"++", "--", *_ASSIGNING}
_FIXED = {"uniform", "const", "in", "flat", "precision", "struct"}
_NAME = re.compile(r"[A-Za-z_]")
_CONDITIONAL = re.compile(r"[ \t]*#[ \t]*(if|el|endif)")
_MACRO = re.compile(r"^[ \t]*#define (\w+)\([^()]*\) (.*)$", re.M)


@dataclass(frozen=True)
class Bracketed:
    """Tokens in brackets. If both branches of an ``#if`` open a bracket that is closed once, the
    first branch's group has no closing bracket."""

    opening: str
    items: tuple[Item, ...]
    closing: str


Item = str | Bracketed


def without_branches(text: str) -> str:
    """Rewrite selections in functions as calls of ``FUNCTIONS``; lines keep their numbers."""
    items = _grouped(text)
    functions = _functions(items)
    parameters = frozenset(item for _, _, arguments, _ in functions
                           for item in _flat(arguments.items) if isinstance(item, str))
    return _Writer(harmless_functions(text, items, parameters), parameters).written(items, False)


def _grouped(text: str) -> tuple[Item, ...]:
    open_groups: list[tuple[str, list[Item]]] = [("", [])]
    conditionals: list[int] = []    # number of open groups at each open ``#if``

    def close(closing: str) -> None:
        opening, items = open_groups.pop()
        open_groups[-1][1].append(Bracketed(opening, tuple(items), closing))

    for token in (found[0] for found in _TOKEN.finditer(text)):
        word = _CONDITIONAL.match(token)
        if word and word[1] == "if":
            conditionals.append(len(open_groups))
        elif word and conditionals:
            while len(open_groups) > conditionals[-1] and word[1] == "el":
                close("")
            if word[1] == "endif":
                conditionals.pop()
        if token in _CLOSING:
            open_groups.append((token, []))
        elif token == _CLOSING.get(open_groups[-1][0]):
            close(token)
        else:
            open_groups[-1][1].append(token)
    while len(open_groups) > 1:
        close("")
    return tuple(open_groups[0][1])


def _plain(item: Item) -> str:
    if isinstance(item, str):
        return item
    return item.opening + "".join(map(_plain, item.items)) + item.closing


def _is_blank(item: Item) -> bool:
    return isinstance(item, str) and (item.isspace() or item.startswith("//"))


def _is_directive(item: Item) -> bool:
    return isinstance(item, str) and item.lstrip().startswith("#")


# Which calls have no effect ---------------------------------------------------------------------


def _flat(items: Iterable[Item]) -> Iterable[Item]:
    """Yield all items except blanks, each group before its items."""
    for item in items:
        if not _is_blank(item):
            yield item
        if isinstance(item, Bracketed):
            yield from _flat(item.items)


def _calls(items: Sequence[Item]) -> set[str]:
    found = set()
    inside = [item for item in items if not _is_blank(item)]
    for before, item in zip(["", *inside], inside):
        if isinstance(item, Bracketed):
            found |= _calls(item.items)
            if item.opening == "(" and isinstance(before, str) and _NAME.match(before):
                found.add(before)
    return found - {"return", "if"}


def _statements(items: Sequence[Item]) -> Iterable[list[Item]]:
    """Yield the functions, and the statements outside of them."""
    statement: list[Item] = []
    for item in items:
        if not _is_blank(item) and not _is_directive(item):
            statement.append(item)
            if item == ";" or (isinstance(item, Bracketed) and item.opening == "{"):
                yield statement
                statement = []


def _functions(items: Sequence[Item]) -> list[tuple[str, str, Bracketed, Bracketed]]:
    return [(str(one[0]), str(one[1]), one[2], one[3]) for one in _statements(items)
            if len(one) == 4 and isinstance(one[2], Bracketed) and isinstance(one[3], Bracketed)]


def harmless_functions(text: str, items: Sequence[Item], parameters: frozenset[str]
                       ) -> frozenset[str]:
    """Return the functions and macros that may be called even if their value is not needed."""
    bodies: dict[str, list[Sequence[Item]]] = {}
    changing = set().union(*map(_declared, _statements(items)))
    for kind, name, arguments, body in _functions(items):
        is_plain = kind in TYPES and not {"out", "inout"} & set(map(str, _flat(arguments.items)))
        bodies.setdefault(name, []).append(body.items if is_plain else ("discard",))
    for name, body in _MACRO.findall(text):
        macro = _grouped(body)
        bodies.setdefault(name, []).append(
            ("discard",) if _CHANGING & set(map(str, _flat(macro))) else macro)

    def is_harmless(body: Sequence[Item], harmless: set[str]) -> bool:
        # `for (` and `while (` look like calls of unknown functions, so loops are not harmless.
        words = {item.partition(".")[0] for item in _flat(body) if isinstance(item, str)}
        return (not words & (changing | {"discard"}) and _calls(body) <= harmless
                and not _reads_element(body, parameters))

    found = set(BUILT_IN)
    while True:
        more = {name for name, texts in bodies.items() if name not in found
                and all(is_harmless(body, found | {name}) for body in texts)}
        if not more:
            return frozenset(found)
        found |= more


def _declared(statement: Sequence[Item]) -> set[str]:
    """Return the variables that a statement outside of functions declares."""
    if statement[-1] != ";" or statement[0] in _FIXED:
        return set()
    return {item for item in statement[1:] if isinstance(item, str) and _NAME.match(item)}


def _reads_element(items: Sequence[Item], parameters: frozenset[str]) -> bool:
    """Return whether a value reads an array at an index that may lie outside the array."""
    return any(isinstance(item, Bracketed) and item.opening == "["
               and _plain(item)[1:-1].strip() not in parameters for item in _flat(items))


# Writing ----------------------------------------------------------------------------------------


class _Writer:
    def __init__(self, harmless: frozenset[str], parameters: frozenset[str]) -> None:
        self._harmless, self._parameters = harmless, parameters

    def written(self, items: Sequence[Item], in_function: bool) -> str:
        parts, segment, is_constant = [], [], False
        for item in (*items, ""):
            if item == "" or item in _ENDS or (
                    isinstance(item, Bracketed) and item.opening == "{"):
                is_constant = is_constant or "const" in segment
                change = in_function and not is_constant
                parts.append((self._expression if change else self._copied)(segment))
                segment = []
                parts.append(self._group(item) if isinstance(item, Bracketed) else item)
                is_constant = is_constant and item != ";"
            else:
                segment.append(item)
        return "".join(parts)

    def _group(self, group: Bracketed, in_function: bool = True) -> str:
        return group.opening + self.written(group.items, in_function) + group.closing

    def _copied(self, items: Sequence[Item]) -> str:
        return "".join(map(_plain, items))

    def _expression(self, items: Sequence[Item]) -> str:
        if "?" in items:
            return self._picked(items)
        for operator, function in (("||", "either_holds"), ("&&", "both_hold")):
            if operator in items:
                return self._folded(_split(items, operator), operator, function)
        return "".join(item if isinstance(item, str) else self._group(item) for item in items)

    def _picked(self, items: Sequence[Item]) -> str:
        first = items.index("?")
        depth = 0
        for at in range(first + 1, len(items)):
            depth += (items[at] == "?") - (items[at] == ":")
            if depth < 0:
                break
        three = items[:first], items[first + 1:at], items[at + 1:]
        texts = [self._expression(part) for part in three]
        if all(map(_is_name, three[1:])) or not (
                self._changes_nothing(three[0]) and all(map(self._is_harmless, three[1:]))):
            return f"{texts[0]}?{texts[1]}:{texts[2]}"
        return _called("picked_value", texts)

    def _folded(self, parts: list[Sequence[Item]], operator: str, function: str) -> str:
        """Write `a && b && c` as nested calls where possible, from left to right."""
        text, is_harmless = self._expression(parts[0]), self._changes_nothing(parts[0])
        for part in parts[1:]:
            other = self._expression(part)
            is_harmless = is_harmless and self._is_harmless(part)
            text = _called(function, [text, other]) if is_harmless else (
                f"{text}{operator}{other}")
        return text

    def _changes_nothing(self, items: Sequence[Item]) -> bool:
        """Return whether computing a value changes nothing. For a selection's first operand, this
        test suffices, because the first operand is always computed."""
        words = [item for item in _flat(items) if isinstance(item, str)]
        return _calls(items) <= self._harmless and not any(
            word in _CHANGING or _is_directive(word) for word in words)

    def _is_harmless(self, items: Sequence[Item]) -> bool:
        """Return whether a value may be computed even if it is not needed."""
        return self._changes_nothing(items) and not _reads_element(items, self._parameters)


def _split(items: Sequence[Item], operator: str) -> list[Sequence[Item]]:
    ends = [-1, *(at for at, item in enumerate(items) if item == operator), len(items)]
    return [items[before + 1:end] for before, end in zip(ends, ends[1:])]


def _is_name(items: Sequence[Item]) -> bool:
    """Return whether a value is a plain name or constant, for which ANGLE makes no branch."""
    return len([item for item in items if not _is_blank(item)]) == 1 and not any(
        isinstance(item, Bracketed) for item in items)


def _called(name: str, values: list[str]) -> str:
    """Write a call, and keep the blanks around the selection."""
    joined = ", ".join(value.strip(" ") for value in values)
    before, after = (value[:len(value) - len(value.lstrip(" "))]
                     for value in (values[0], values[-1][::-1]))
    return f"{before}{name}({joined}){after}"
