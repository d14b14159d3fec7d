"""Declarations of a GLSL program: splits a text, and marks the parts that ``main`` uses."""
from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

_WORD = re.compile(r"\w+")
_PASTE = re.compile(r"(\w+)##(\w+)")
_DEFINE = re.compile(r"\s*#\s*define\s+(\w+)")
_LAYOUT = re.compile(r"layout\s*\([^)]*\)")
_FUNCTION = re.compile(r"[\w\s]*\w\s+(\w+)\s*\(")
_MACRO_CALL = re.compile(r"\s*\w+\([^;{]*\)")
_BRACKETS = re.compile(r"\([^()]*\)|\[[^][]*\]|\{[^{}]*\}")


@dataclass
class Declaration:
    """A declaration with the comment above it; or a separate comment, if ``code`` is empty.

    Attributes
    ----------
    file : File of the declaration, or ``<name>`` for a generated text.
    comment, code : Lines as the file has them.
    names : Declared names. Empty for a declaration that is always kept.
    is_used : Whether ``main`` reaches the declaration.
    is_spaced : Whether an empty line is above the declaration.
    """

    file: str
    comment: list[str] = field(default_factory=list)
    code: list[str] = field(default_factory=list)
    names: set[str] = field(default_factory=set)
    is_used: bool = False
    is_spaced: bool = False

    @property
    def bare(self) -> str:
        return "\n".join(line.partition("//")[0].rstrip() for line in self.code)


def used_declarations(lines: Sequence[str], files: Sequence[str]) -> list[Declaration]:
    """Return the declarations that ``main`` reaches, and their comments.

    A declaration is reached if its name occurs in a reached declaration. This rule keeps every
    needed declaration, and possibly unneeded declarations. A separate comment is kept if a
    declaration between this comment and the next separate comment is used. A file's first comment
    is kept if any declaration of the file is used.

    Parameters
    ----------
    lines : a program's text without conditionals
    files : the file of each line
    """
    found = list(_declarations(lines, files))
    _mark_reached(found)
    for file in dict.fromkeys(one.file for one in found):
        _mark_comments([one for one in found if one.file == file])
    return [one for one in found if one.is_used]


def _declarations(lines: Sequence[str], files: Sequence[str]) -> Iterator[Declaration]:
    present = Declaration("")
    for line, file in zip(lines, files):
        is_code = bool(line.partition("//")[0].strip())
        if not present.code and (file != present.file or not line.strip()):
            if present.comment:
                yield present
            present = Declaration(file, is_spaced=not line.strip())
        if present.code or is_code:
            present.code.append(line)
            if _is_complete(present.bare):
                present.names = _declared(present.bare)
                yield present
                present = Declaration(file)
        elif line.strip():
            present.comment.append(line)
    if present.comment or present.code:
        yield present


def _is_complete(code: str) -> bool:
    if code.lstrip().startswith("#"):
        return not code.endswith("\\")
    balanced = all(code.count(a) == code.count(b) for a, b in ("{}", "()"))
    return balanced and (code.endswith((";", "}")) or _MACRO_CALL.fullmatch(code) is not None)


def _declared(code: str) -> set[str]:
    """Return the names that a declaration declares. Declarations that are always kept have no
    names: main, inputs, outputs, macro calls, and directives other than #define."""
    if found := _DEFINE.match(code):
        return {found[1]}
    head = _LAYOUT.sub("", code)
    words = _WORD.findall(head)
    if (code.lstrip().startswith("#") or not words or words[0] in ("precision", "invariant")
            or {"in", "out"} & set(_WORD.findall(head.partition("(")[0]))):
        return set()
    inside = set(_DEFINE.findall(code.partition("\n")[2]))
    if words[0] == "struct":
        return {words[1], *_WORD.findall(head.rpartition("}")[2]), *inside}
    if (found := _FUNCTION.match(head)) and "=" not in found[0]:
        return {found[1], *inside} if found[1] != "main" else set()
    if _MACRO_CALL.match(head):
        return set()
    while (flat := _BRACKETS.sub("", head)) != head:    # removes commas between arguments, too
        head = flat
    declarators = [part.partition("=")[0] for part in head.partition(";")[0].split(",")]
    return {found[-1] for part in declarators if (found := _WORD.findall(part))}


def _mark_reached(declarations: Sequence[Declaration]) -> None:
    words: set[str] = set()
    pastes: set[tuple[str, str]] = set()
    fresh = [one for one in declarations if one.code and not one.names]
    while fresh:
        for one in fresh:
            one.is_used = True
            words.update(_WORD.findall(one.bare))
            pastes.update(_PASTE.findall(one.bare))
        # Any word of the program may be the argument that a macro pastes with ##.
        made = {text for a, b in pastes for word in words for text in (word + b, a + word)}
        fresh = [one for one in declarations if not one.is_used and one.names & (words | made)]


def _mark_comments(of_file: Sequence[Declaration]) -> None:
    alone = [at for at, one in enumerate(of_file) if not one.code]
    for at, after in zip(alone, [*alone[1:], len(of_file)]):
        below = of_file[1:] if at == 0 else of_file[at + 1:after]
        of_file[at].is_used = any(one.is_used for one in below if one.code)
