"""``python -m gpgpu_rt.figures``: measure what is missing, then draw every figure."""
from __future__ import annotations

import argparse
import contextlib
import sys
from importlib import import_module
from pathlib import Path

from gpgpu_rt.cli.parser import Parser
from gpgpu_rt.cli.streams import printed
from gpgpu_rt.disk.files import check_writable
from gpgpu_rt.errors import Error, how_to_install, nearest_names
from gpgpu_rt.interrupts import STATUS
from gpgpu_rt.text_format import counted
from gpgpu_rt.workers import Workers

NEEDED = ("distributed", "flip_evaluator", "matplotlib", "tqdm")     # the extra `figures`
try:
    for name in NEEDED:
        import_module(name)
    from .framework import crate, pages, provenance, summary
    from .framework.catalogue import FIGURES, figure_of
    from .framework.index_page import IndexEntry, write_index
    from .framework.measure import measure
    from .framework.output import number
    from .framework.verdicts import Verdict
except ModuleNotFoundError as missing:
    if missing.name not in NEEDED:
        raise
    sys.exit(f"figures: {missing.name} is not installed; {how_to_install('figures')}")


def main(arguments: list[str] | None = None) -> int:
    """Run the command, and return its exit status.

    The status is 0 on success, 1 after an `Error` (one line on stderr) or if `--check` finds a
    difference, and 130 after an interrupt. Wrong arguments end the process with status 2.
    """
    return printed(lambda: _main(arguments))


def _main(arguments: list[str] | None) -> int:
    parser = _FigureParser(prog="python -m gpgpu_rt.figures", description=__doc__)
    parser.add_argument("--full", action="store_true", help="use the papers' resolutions")
    parser.add_argument("--only", nargs="+", type=_figure, default=list(FIGURES), metavar="NAME",
                        help=f"draw only these figures, out of {', '.join(FIGURES)}")
    parser.add_argument("--again", action="store_true", help="repeat measurements that are "
                        "already finished")
    parser.add_argument("--scheduler", metavar="local|ADDRESS", help="measure with a process per "
                        "core (local), or with the workers of the Dask scheduler at ADDRESS; "
                        "while a measurement is timed, nothing else is measured on its machine")
    parser.add_argument("--data", type=Path, default=Path("figures/data"), metavar="FOLDER",
                        help="folder of the measurements; default %(default)s, in the "
                        "current folder")
    parser.add_argument("--out", type=Path, default=Path("figures/out"), metavar="FOLDER",
                        help="folder of the drawn pages; default %(default)s, in the current "
                        "folder")
    parser.add_argument("--check", action="store_true", help="neither measure nor draw; only "
                        "compare the files of --out with their digests in ro-crate-metadata.json")
    chosen = parser.parse_args(arguments)
    try:
        if chosen.check:
            return _check(chosen.out)
        for folder in (chosen.data, chosen.out):
            _make(folder)
        figures = [figure_of(name) for name in chosen.only]
        with contextlib.nullcontext() if chosen.scheduler is None else Workers(
                chosen.scheduler) as workers:
            measure([cell for figure in figures for cell in figure.cells(chosen.full)],
                    chosen.data, chosen.again, workers)
        pages.draw(chosen.only, chosen.data, chosen.out, chosen.full)
        _index(chosen.out)
        crate.write(chosen.out)
    except KeyboardInterrupt:
        if any(chosen.data.glob("*.json")):
            print("figures: finished measurements are kept; run the command again to continue",
                  file=sys.stderr)
        return STATUS
    except Error as failure:
        print(f"figures: {' '.join(str(failure).split())}", file=sys.stderr)
        return 1
    print(f"wrote {chosen.out / 'index.md'}")
    return 0


def _check(out: Path) -> int:
    """Print every difference between the files in ``out`` and their description (crate.py).

    Return the exit status: 1 if there is a difference, and 0 otherwise.
    """
    wrong = crate.faults(out)
    for line in wrong:
        print(line)
    print(f"{out}: {counted(crate.count(out), 'file')} listed in {crate.NAME}, "
          + (counted(len(wrong), "fault") if wrong else "all as listed"))
    return 1 if wrong else 0


class _FigureParser(Parser):
    speaker = "figures"


def _figure(name: str) -> str:
    if name not in FIGURES:
        asked = f"fig{name:0>2}" if name.isdecimal() else name
        raise argparse.ArgumentTypeError(f"no figure {name!r}{nearest_names(asked, FIGURES)}")
    return name


def _index(out: Path) -> None:
    """Write the index of all pages in ``out``, from this run and from earlier runs."""
    pages = {name: page for name in FIGURES if (page := provenance.held(name, out))}
    lines = [IndexEntry(name, FIGURES[name],
                        Verdict.from_json(page["verdict"]),
                        provenance.summary(page)) for name, page in pages.items()]
    seconds, unknown = provenance.spent(pages.values())
    quick = [name for name, page in pages.items() if page["size"] == "quick"]
    size = "quick" if len(quick) == len(pages) else "the papers'"
    if 0 < len(quick) < len(pages):
        size += f", but quick for {', '.join(quick)}"
    write_index(out, lines, summary.sentences(pages), [
        f"Size of the measurements: {size}. All measurements together took "
        f"{number(seconds / 60)} minutes of processor time"
        + (f", not counting {counted(unknown, 'cell')} that an older version measured without a "
           "clock." if unknown else ".")
        + ("" if not quick else " At the quick size fewer rays are traced than in the papers, so "
           "compare times per ray. `make figures FULL=1` uses the papers' sizes. If you interrupt "
           "this command, the next run continues from the finished measurements.")])


def _make(folder: Path) -> None:
    """Make a missing folder, and print its name. So the user sees a misspelled name before hours
    of measuring."""
    is_new = not folder.exists()
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as failure:
        raise Error(f"cannot make the folder {folder}: {failure.strerror}; choose another "
                    "folder with --data or --out") from failure
    check_writable(folder / "index.md")
    if is_new:
        print(f"figures: made the folder {folder}", file=sys.stderr)
