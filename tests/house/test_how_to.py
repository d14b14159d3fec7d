"""The error messages that how-to pages show are the messages that a user gets.

A ``text`` block that begins with ``$ COMMAND`` shows the message of a command that fails. "..."
stands for words that are left out. Line breaks may differ from the terminal's.
"""
from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from snippets import PAGES, Snippet, missing, snippets, without_meshes

HOW_TO = [page for page in PAGES if page.parent.name == "how-to"]
MOST_LINES = 100


def message_of(block: Snippet) -> tuple[str, str] | None:
    """Returns the command that fails and its message, if the block shows them."""
    if block.language != "text" or not block.text.startswith("$ "):
        return None
    command, _, message = block.text[2:].partition("\n")
    return command, message


MESSAGES = [pytest.param(*found, id=block.place) for page in HOW_TO for block in snippets(page)
            if (found := message_of(block))]


def shell(command: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Runs a command; returns its result, in which stdout also contains the command's stderr."""
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    return subprocess.run(["bash", "-eo", "pipefail", "-c", command], cwd=folder, text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=180,
                          env={**os.environ, "PATH": path})


@pytest.mark.parametrize("command, message", MESSAGES)
def test_a_message_is_as_shown(exact_renderer, tmp_path: Path, command: str,
                               message: str) -> None:
    rays = {"origins": np.zeros((4, 3)), "directions": np.ones((4, 3))}
    np.savez(tmp_path / "rays.npz", **rays)
    np.savez(tmp_path / "renamed.npz", o=rays["origins"], d=rays["directions"])
    rays["directions"][2] = np.nan
    np.savez(tmp_path / "nan.npz", **rays)
    with without_meshes(tmp_path):
        answer = shell(command, tmp_path)
    assert answer.returncode == 1, answer.stdout
    assert missing(message, answer.stdout) is None, answer.stdout


@pytest.mark.parametrize("page", HOW_TO, ids=lambda page: page.stem)
def test_a_page_has_its_parts_and_is_short(page: Path) -> None:
    text = page.read_text()
    assert text.count("\n") <= MOST_LINES
    if page.stem != "index":
        assert all(part in text for part in ("**Goal**: ", "## What can go wrong\n",
                                             "## Read more\n"))
        assert f"]({page.name})" in (page.parent / "index.md").read_text()
