"""Tests that the commands and the Python code in README, docs/hardware.md, docs/replication.md,
the tour and the how-to pages run as the pages show them."""
from __future__ import annotations

import re
from pathlib import Path

import pytest
from snippets import PAGES, ROOT, commands, missing, mistakes, run_page, snippets


def name_of(page: Path) -> str:
    return str(page.relative_to(ROOT))


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_each_block_is_run_or_says_why_not(page: Path) -> None:
    assert mistakes(page) == []


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_page_runs(exact_renderer, page: Path, tmp_path: Path) -> None:
    blocks = [block for block in snippets(page) if block.is_run]
    assert run_page(page, tmp_path) == len(blocks)


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_a_word_to_be_replaced_is_explained(page: Path) -> None:
    """A word in capitals, such as ADDRESS, is a placeholder that the prose of the page
    explains."""
    prose = re.sub(r"(?ms)^```.*?^```$", "", page.read_text(encoding="utf-8"))
    words = {word for block in snippets(page) if block.language == "sh"
             for line in commands(block)
             for word in re.findall(r"(?<![\w$.=/-])[A-Z]{3,}(?![\w=./:-])", line)}
    assert {word for word in words if word not in prose} == set()


PAGE = """# A page

<!-- file: box.json -->
```json
{"meshes": [{"box": {"size": [1, 1, 1]}}]}
```

```sh
gpgpu-rt info | cat     # a comment
echo a \\
    b > said.txt
```

```python
words = open("said.txt").read().split()
```

```python
assert words == ["a", "b"] and open("box.json").read()
```

<!-- not run: needs a display -->
```sh
gpgpu-rt view bunny
```

<!-- test with: --json -->
```sh
gpgpu-rt methods > methods.json
```

```sh
echo 12 rays,   0.31 s; echo; echo second; echo third
```

```text
12 rays, ... s
...
third
```

```python
print("four", 4)
```

```text
four 4
```
"""


@pytest.fixture
def page(tmp_path: Path) -> Path:
    path = tmp_path / "page.md"
    path.write_text(PAGE)
    return path


def test_blocks_of_a_page(page: Path, tmp_path: Path) -> None:
    languages = [block.language for block in snippets(page)]
    assert languages == ["json", "sh", "python", "python", "sh", "sh", "sh", "text",
                         "python", "text"]
    assert [block.is_run for block in snippets(page)] == [
        False, True, True, True, False, True, True, False, True, False]
    assert commands(snippets(page)[1]) == ["gpgpu-rt info | cat", "echo a b > said.txt"]
    assert commands(snippets(page)[5]) == ["gpgpu-rt methods --json > methods.json"]
    assert mistakes(page) == [] and run_page(page, tmp_path) == 6
    assert (tmp_path / "methods.json").read_text().startswith("[")


@pytest.mark.parametrize("old, new, message", [
    ("gpgpu-rt info", "gpgpu-rt inof", "page.md:9: exit status 2"),
    ('["a", "b"]', '["a"]', "page.md:19: AssertionError"),
    ('"said.txt"', '"sad.txt"', "page.md:15: FileNotFoundError"),
    ("12 rays, ...", "13 rays, ...", "page.md:37: the output lacks '13 rays,'"),
    ("four 4", "four 5", "page.md:47: the output lacks 'four 5'")])
def test_an_error_names_its_place(page: Path, tmp_path: Path, old: str, new: str,
                                  message: str) -> None:
    page.write_text(PAGE.replace(old, new))
    with pytest.raises(AssertionError, match=message):
        run_page(page, tmp_path)


@pytest.mark.parametrize("shown, part", [
    ("1 ray of 2\n0.5 s\n", None), ("1\n  ray ... s", None), ("... ray of ... s", None),
    ("1 ray of 2\n... s ...", None), ("...", None), ("", None), ("1 r... 0.5", None),
    ("ray (...) s", "ray (...) s"), ("ray 2", "ray 2"), ("ay of", "ay of"), ("ray o", "ray o"),
    ("2 ... ray", "ray"), ("1 ... 1", "1"), ("1 ray of 3 ... s", "1 ray of 3")])
def test_left_out_words_must_be_marked(shown: str, part: str | None) -> None:
    """`missing` returns the first shown part that the output lacks. Words may be left out only
    where the page shows "..."."""
    assert missing(shown, "1 ray of  2\n\n0.5 s") == part


@pytest.mark.parametrize("old, new, message", [
    ("gpgpu-rt info", "make test", "page.md:9: make is not run in tests"),
    ("echo a", "$ echo a", r"page.md:9: $ is not run in tests"),
    ("```sh", "```bash", "call the language sh"),
    ("-->\n```sh", "-->\n\nText.\n\n```sh", "not on the line before a block")])
def test_a_block_left_out_needs_a_reason(page: Path, old: str, new: str, message: str) -> None:
    page.write_text(PAGE.replace(old, new))
    assert message in "\n".join(mistakes(page))
