"""Runs the commands and the Python of a Markdown page, as a reader would.

A page's blocks run in order, in one temporary folder. A block can therefore use files and names of
earlier blocks. A ``sh`` block runs as a script of the shell, and ``python`` blocks share their
names. A comment in the page, on the line before a block, changes how the block is run:

``<!-- not run: REASON -->``
    Skip the block: it needs a display or a network, or takes too long.
``<!-- test with: --size 64 -->``
    Append these words to each ``gpgpu-rt`` command of the block, so that the test is quick.
``<!-- file: NAME -->``
    Write the block, which may have any language, to the file NAME for later blocks.

Each line of a ``sh`` block that is run must begin with a command that every machine has
(COMMANDS).

A ``text`` block after a block that is run shows the output of that block. "..." stands for words
and lines that are left out. The page may break lines at other places, and several spaces count as
one. A ``text`` block that begins with ``$ COMMAND`` shows another command, and is not compared
here.
"""
from __future__ import annotations

import contextlib
import io
import os
import re
import subprocess
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import pytest

import gpgpu_rt as rt

ROOT = Path(rt.__file__).parents[1]
# The pages that are run whole.
PAGES = sorted([ROOT / "README.md", *(ROOT / "docs" / name
                                      for name in ("hardware.md", "replication.md")),
                *ROOT.glob("docs/tour/*.md"), *ROOT.glob("docs/how-to/*.md")])
# If a line begins with another word, the block needs a comment "not run" with a reason.
COMMANDS = ("gpgpu-rt", "python", "mkdir", "cd", "cat", "ls", "echo")
SECONDS = 180       # time limit of a ``sh`` block
_OTHER_NAMES = ("bash", "shell", "console", "shell-session", "py", "python3", "pycon")
_BLOCK = re.compile(r"(?ms)^(?:<!-- (not run|test with|file): (.+?) -->\n\n?)?"
                    r"^(`{3,})([\w-]*)[^\n]*\n(.*?)^\3$")


@dataclass(frozen=True)
class Snippet:
    """A fenced block of a page.

    Attributes
    ----------
    page : the Markdown file
    line : the number of the block's first line of content, from 1
    language : the word after the opening fence, or ""
    text : the content
    marker, value : the comment before the block, such as "test with" and "--size 64"; else ""
    """

    page: Path
    line: int
    language: str
    text: str
    marker: str = ""
    value: str = ""

    @property
    def place(self) -> str:
        return f"{self.page.name}:{self.line}"

    @property
    def is_run(self) -> bool:
        return self.language in ("sh", "python") and self.marker not in ("not run", "file")


def snippets(page: Path) -> list[Snippet]:
    """Returns the fenced blocks of a Markdown page, in their order."""
    text = page.read_text(encoding="utf-8")
    return [Snippet(page, text.count("\n", 0, block.start(5)) + 1, block[4], block[5],
                    block[1] or "", block[2] or "") for block in _BLOCK.finditer(text)]


def commands(block: Snippet) -> list[str]:
    """Returns the commands of a ``sh`` block, without comments. Continued lines are joined, and
    the words of ``test with`` are inserted before a pipe or a redirection."""
    lines = re.sub(r"\\\n\s*", "", block.text).splitlines()
    found = [re.split(r"(?:^|\s+)#", line, maxsplit=1)[0].strip() for line in lines]
    more = f" {block.value}" if block.marker == "test with" else ""
    return [re.sub(r"^(gpgpu-rt\b[^|>]*?)(\s*[|>].*)?$", rf"\1{more}\2", line)
            for line in found if line]


def mistakes(page: Path) -> list[str]:
    """Returns a line for each mistake of a page: another name for the languages sh and python, a
    command that tests do not run, or a comment for tests that is not before a block."""
    found = []
    for block in snippets(page):
        if block.language in _OTHER_NAMES:
            found.append(f"{block.place}: call the language sh or python, not {block.language}")
        if block.language == "sh" and block.is_run:
            found += [f"{block.place}: {line.split()[0]} is not run in tests; put the comment "
                      "'<!-- not run: REASON -->' on the line before the block"
                      for line in commands(block) if line.split()[0] not in COMMANDS]
    comments = re.findall(r"<!-- (?:not run|test with|file)\b", page.read_text(encoding="utf-8"))
    used = [block for block in snippets(page) if block.marker]
    if len(comments) > len(used):
        found.append(f"{page.name}: a comment for tests is not on the line before a block")
    return found


def run_page(page: Path, folder: Path) -> int:
    """Runs a page's blocks in a folder and returns how many blocks ran.

    The folder gets a link ``examples`` to the project's examples. The working directory is the
    folder while Python blocks run.

    Raises
    ------
    AssertionError
        A command ended with an error, or the output lacks a part of a ``text`` block. The message
        has the page, the line and the output.
    """
    examples = folder / "examples"
    if not examples.exists():
        examples.symlink_to(ROOT / "examples", target_is_directory=True)
    names: dict[str, object] = {"__name__": "page"}
    with without_meshes(folder):
        return _run_blocks(page, folder, names)


@contextlib.contextmanager
def without_meshes(folder: Path) -> Iterator[None]:
    """Hides the papers' meshes, because the pages show the numbers of the stand-in scenes."""
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("GPGPU_RT_SCENES", raising=False)
        patch.setenv("XDG_DATA_HOME", str(folder / "no data"))
        yield


def _run_blocks(page: Path, folder: Path, names: dict[str, object]) -> int:
    count = 0
    said: str | None = None      # the output of the previous block
    for block in snippets(page):
        if block.marker == "file":
            target = folder / block.value
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_text(block.text, encoding="utf-8")
        elif block.is_run:
            run = _run_commands if block.language == "sh" else _run_python
            said = run(block, folder, names)
            count += 1
        elif block.language == "text" and said is not None and not block.text.startswith("$ "):
            part = missing(block.text, said)
            assert part is None, f"{block.place}: the output lacks {part!r}:\n{said}"
            said = None
        else:
            said = None
    return count


def missing(shown: str, said: str) -> str | None:
    """Returns the first part of ``shown`` that the output ``said`` lacks; None if the output has
    all parts in their order.

    ``shown`` is the content of a ``text`` block. The word "..." separates its parts. "..." inside
    a word stands for any letters and spaces.
    """
    said, at = " ".join(said.split()), 0
    for part in re.split(r"(?:^|(?<=\s))\.\.\.(?=\s|$)", shown):
        words = " ".join(part.split())
        pattern = ".*?".join(map(re.escape, words.split("...")))
        found = re.compile(rf"(?<!\S){pattern}(?!\S)").search(said, at)
        if words and found is None:
            return words
        at = found.end() if words and found else at
    return None


def _run_commands(block: Snippet, folder: Path, _: Mapping[str, object]) -> str:
    """Runs a block's commands in one shell, which ends at the first error, even inside a pipe.
    Returns what the commands printed."""
    here = Path(sys.executable).parent      # the folder of the commands gpgpu-rt and python
    environment = {**os.environ, "PATH": os.pathsep.join([str(here), os.environ["PATH"]])}
    answer = subprocess.run(["bash", "-eo", "pipefail", "-c", "\n".join(commands(block))],
                            cwd=folder, text=True, stdout=subprocess.PIPE,
                            stderr=subprocess.STDOUT, env=environment, timeout=SECONDS)
    assert answer.returncode == 0, (f"{block.place}: exit status {answer.returncode}\n"
                                    f"{block.text}{answer.stdout[-2800:]}")
    return answer.stdout


def _run_python(block: Snippet, folder: Path, names: dict[str, object]) -> str:
    """Runs a block with the names that earlier blocks defined, and returns what the block printed.

    A traceback shows the page's own line. The block can import files of the folder, as a script
    there can.
    """
    code = compile("\n" * (block.line - 1) + block.text, str(block.page), "exec")
    before = Path.cwd()
    os.chdir(folder)
    try:
        with pytest.MonkeyPatch.context() as patch, \
                contextlib.redirect_stdout(io.StringIO()) as printed:
            patch.syspath_prepend(folder)
            exec(code, names)
    except Exception as error:
        raise AssertionError(f"{block.place}: {type(error).__name__}: {error}") from error
    finally:
        os.chdir(before)
    return printed.getvalue()
