"""Plugins: loads a user's methods from Python files and checks the methods' rows.

Each file defines its rows as ``ROWS`` (docs/how-to/add-a-method.md).
"""
from __future__ import annotations

import hashlib
import importlib.util
import os
import re
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from ..errors import Error, MethodError
from ..gl import record as gl_record
from ..gl.fragment_counter import TARGETS
from ..gl.packed_record import PackedRecord
from ..gl.record import FIELD_TYPES, Record
from ..gl.shader import ROOT
from ..options import Option
from ..rays.records import COUNTERS, HIT
from ..traversal import triangle_table
from ..traversal.assembly import driver_class
from ..traversal.method import SCHEDULES, Method
from .prepared import guarded, message_of, place_of

VARIABLE = "GPGPU_RT_METHODS"
_NAME = re.compile(r"[a-z][a-z0-9]*(-[a-z0-9]+)*")
_MOST_KERNELS = 4    # the largest number of kernels of a row in a user's file
# A pass writes the state and the hit; with statistics, it also writes the counters. Each texel of
# these records needs a render target.
MOST_STATE_TEXELS = TARGETS - HIT.texels - COUNTERS.texels
# Old module names, which method files for version 0.1 import.
_FORMER_NAMES = {"gpgpu_rt.record": gl_record, "gpgpu_rt.texel_layout": triangle_table}


def named_folders() -> list[Path]:
    """Return the folders in the environment variable GPGPU_RT_METHODS, separated as in PATH."""
    return [Path(one) for one in os.environ.get(VARIABLE, "").split(os.pathsep) if one]


def name_folder(folder: Path) -> None:
    """Add the folder to GPGPU_RT_METHODS, so that child processes load its methods too."""
    if folder not in named_folders():
        os.environ[VARIABLE] = os.pathsep.join(map(str, [*named_folders(), folder]))


def files_of(folder: Path) -> list[Path]:
    """Return a folder's method files, sorted, without names that begin with "_" or "test_"."""
    if folder.is_file():
        raise MethodError(f"{folder} is a file; give its folder, {folder.parent}")
    if not folder.is_dir():
        raise MethodError(f"there is no folder of methods {folder}; create the folder, or remove "
                          f"it from --methods-from and {VARIABLE}")
    return sorted(path for path in folder.glob("*.py") if not path.name.startswith(("_", "test_")))


def rows_of(path: Path) -> list[Method]:
    """Run a method file and return its checked rows.

    Raises
    ------
    MethodError
        if the file fails to run or a row is invalid; the message names the file, and the line or
        the method
    """
    # The hash of the path distinguishes files of the same name in two folders.
    place = hashlib.sha256(os.fsencode(path.resolve())).hexdigest()[:12]
    name = f"gpgpu_rt_method_{path.stem}_{place}"
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    for former, present in _FORMER_NAMES.items():
        sys.modules.setdefault(former, present)
    sys.modules[name] = module      # pickle and dataclasses look up classes in sys.modules
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as failure:
        del sys.modules[name]
        raise MethodError(f"{place_of(path, failure)}: {type(failure).__name__}: "
                          f"{message_of(failure)}") from failure
    rows = getattr(module, "ROWS", None)
    if not isinstance(rows, (list, tuple)) or not all(isinstance(row, Method) for row in rows):
        raise MethodError(f"{path}: the file has no ROWS; end it with ROWS = (Method(...),)")
    for row in rows:
        _check(row, path)
    return [replace(row, prepare=guarded(row, path)) for row in rows]


def register_folder(folder: Path, register: Callable[[Method, Path], Method]) -> None:
    """Load the method files of a folder and call ``register`` with each row."""
    for path in files_of(folder):
        for row in rows_of(path):
            try:
                register(row, path)
            except Error as failure:
                raise MethodError(f"{path}: {failure}; rename the method") from failure


def _check(row: Method, path: Path) -> None:
    """Raise MethodError for a mistake that could otherwise show only during traversal."""
    where = f"{path}, method {row.name!r}"
    if not isinstance(row.name, str) or not _NAME.fullmatch(row.name):
        raise MethodError(f"{where}: invalid name; use words of a-z and 0-9, joined by -")
    _check_kinds(row, where)
    missing = {"phase", "steps"} - {field.name for field in row.state.fields}
    if missing:
        raise MethodError(f"{where}: the state has no {' and no '.join(sorted(missing))}; "
                          'add "phase:int steps:int"')
    if row.state.texels > MOST_STATE_TEXELS and not row.drivers:
        raise MethodError(f"{where}: the state has {row.state.texels} texels; at most "
                          f"{MOST_STATE_TEXELS} fit beside the hit and the counters; remove "
                          "fields")
    if not 1 <= len(row.kernels) <= _MOST_KERNELS:
        raise MethodError(f"{where}: the row has {len(row.kernels)} kernels; give 1 to "
                          f"{_MOST_KERNELS}")
    unknown = (set(row.schedules) | set(row.drivers)) - set(SCHEDULES)
    if unknown or not row.schedules:
        raise MethodError(f"{where}: invalid schedules; give at least one of "
                          f"{', '.join(SCHEDULES)}")
    for named in row.drivers.values():
        try:
            driver_class(named)
        except MethodError as failure:
            raise MethodError(f"{where}: {failure}") from failure
    if not (ROOT / row.glsl).is_file():     # an absolute path replaces ROOT
        raise MethodError(f"{where}: there is no GLSL file {row.glsl}; name a file in the same "
                          "folder by Path(__file__).with_name(...)")
    text = (ROOT / row.glsl).read_text(errors="replace")
    absent = [kernel for kernel in row.kernels if not re.search(rf"void\s+{kernel}\s*\(", text)]
    # An included file or a macro (##) may define the kernel. A driver may need no kernel.
    if absent and not row.drivers and "#include" not in text and "##" not in text:
        raise MethodError(f"{where}: {row.glsl} has no kernel {absent[0]}; define "
                          f"void {absent[0]}(...), or correct the kernels of the row")


def _check_kinds(row: Method, where: str) -> None:
    if not isinstance(row.state, Record):
        raise MethodError(f"{where}: state is {row.state!r}; give a Record")
    if not isinstance(row.glsl, (str, Path)):
        raise MethodError(f"{where}: glsl is {row.glsl!r}; give the name of a file")
    if not callable(row.prepare):
        raise MethodError(f"{where}: prepare is {row.prepare!r}; give a function")
    for name, values, kinds, what in (
            ("kernels", row.kernels, str, "names"), ("schedules", row.schedules, str, "names"),
            ("options", row.options, Option, "Options"),
            ("tables", row.tables, (Record, PackedRecord), "Records")):
        if isinstance(values, kinds):
            raise MethodError(f"{where}: {name} is not a tuple; end a tuple with one entry by a "
                              "comma: (ENTRY,)")
        if not isinstance(values, (tuple, list)):
            raise MethodError(f"{where}: {name} is {values!r}; give a tuple of {what}")
        wrong = [one for one in values if not isinstance(one, kinds)]
        if wrong:
            raise MethodError(f"{where}: {name} holds {wrong[0]!r}; give only {what}")
    for record in (row.state, *row.tables):
        for word in record.layout.replace("|", " ").split():
            field, _, kind = word.partition(":")
            if not (kind.isdecimal() if isinstance(record, PackedRecord)
                    else (kind or "float") in FIELD_TYPES) or not field.isidentifier():
                known = "1, 2, ..." if isinstance(record, PackedRecord) else ", ".join(FIELD_TYPES)
                raise MethodError(f"{where}: record {record.name} has a field {word!r}; write "
                                  f"NAME:TYPE, with a type of: {known}")
        try:
            _ = record.fields
        except ValueError as failure:       # a texel of the layout has too many components
            raise MethodError(f"{where}: {failure}") from failure
