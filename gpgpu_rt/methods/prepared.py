"""Prepared: checks the accelerators that the ``prepare`` of a user's method returns."""
from __future__ import annotations

import functools
import re
import traceback
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import Error, MethodError, did_you_mean, nearest_names
from ..gl.packed_record import PackedRecord
from ..gl.record import Record
from ..gl.shader import resolve
from ..traversal.accelerator import Accelerator
from ..traversal.method import Method

Prepare = Callable[[np.ndarray, Mapping[str, Any]], Accelerator]


def guarded(row: Method, path: Path) -> Prepare:
    """Return a function that calls the row's ``prepare`` and checks the returned Accelerator.

    Exceptions other than `Error` become a MethodError with a message of one line.

    Parameters
    ----------
    path : the Python file that defines the row
    """
    where = f"{path}, method {row.name!r}"
    code = functools.cache(functools.partial(_code, row))

    def prepare(triangles: np.ndarray, options: Mapping[str, Any]) -> Accelerator:
        try:
            made = row.prepare(triangles, options)
        except Error:
            raise
        except Exception as failure:
            raise MethodError(f"{place_of(path, failure)}: {type(failure).__name__} in prepare: "
                              f"{message_of(failure)}") from failure
        if not isinstance(made, Accelerator):
            raise MethodError(f"{where}: prepare returns {type(made).__name__}; return an "
                              "Accelerator")
        missing = {"scene_lo", "scene_hi"} - set(made.uniforms)
        if missing:     # without them, rays could miss triangles on the faces of boxes
            raise MethodError(f"{where}: prepare returns no {' and no '.join(sorted(missing))}; "
                              "the kernels need these uniforms to widen boxes; add "
                              "**box_uniforms(triangles)")
        if not (row.drivers or row.form or row.entry_walk):     # these may run other programs
            _check_uniforms(made, code(), where)
        records = row.tables_for(options)
        missing = {record.name for record in records} - set(made.tables)
        if missing:
            raise MethodError(f"{where}: prepare returns no table {' and no table '.join(missing)}"
                              "; return its fields, or remove it from the row's tables")
        for record in records:
            if not isinstance(made.tables[record.name], Mapping):
                raise MethodError(f"{where}: table {record.name} has no fields; return a dict "
                                  "from the names of fields to arrays")
            _check_fields(record, made.tables[record.name], where)
        return made
    return prepare


def _code(row: Method) -> str:
    """Return a method's GLSL code without comments, with every file that an option can choose."""
    parts = {part.name: "\n".join(f'#include "{file}"'
                                  for file in (part.plain, *part.files.values()))
             for part in row.parts}
    source = resolve("drivers/traverse.frag", {}, {
        "streams": "", "tables": "", "states": "", "method": f"file:{row.glsl}", **parts})
    return re.sub(r"//[^\n]*|/\*.*?\*/", "", source.text, flags=re.S)


def _check_uniforms(made: Accelerator, code: str, where: str) -> None:
    """Raise MethodError for a uniform that the code does not contain.

    The check reads the text, because compilers may remove declared but unused uniforms."""
    for name in sorted(set(made.uniforms) - set(re.findall(r"\w+", code))):
        near = did_you_mean(name, re.findall(r"\buniform\s+\w+\s+(\w+)", code))
        raise MethodError(f"{where}: prepare returns the uniform {name}, but the GLSL does not "
                          f"declare it{near or '; declare the uniform, or remove it'}")


def _check_fields(record: Record | PackedRecord, fields: Mapping[str, Any], where: str) -> None:
    if isinstance(record, Record):
        widths = {field.name: field.width for field in record.fields}
    else:
        widths = {name: 1 for name, *_ in record.fields}
        if missing := [name for name in widths if name not in fields]:
            raise MethodError(f"{where}: table {record.name} lacks the field {missing[0]}; "
                              "prepare must return every field of a PackedRecord")
    for name, values in fields.items():
        if name not in widths:
            raise MethodError(f"{where}: table {record.name} has no field {name!r}"
                              + nearest_names(name, widths))
        if np.isscalar(values) or getattr(values, "ndim", 1) == 0:
            raise MethodError(f"{where}: field {name} of table {record.name} is a single number; "
                              "give an array with a value for each row")
    arrays = {name: values for name, values in fields.items() if isinstance(values, np.ndarray)}
    rows = {name: len(values) for name, values in arrays.items()}
    if len(set(rows.values())) > 1:
        listed = ", ".join(f"{name} {count}" for name, count in rows.items())
        raise MethodError(f"{where}: the fields of table {record.name} have different numbers "
                          f"of rows: {listed}; give all fields the same number")
    for name, values in arrays.items():
        width = widths[name]
        if values.size != len(values) * width:
            needed = (len(values), width) if width > 1 else (len(values),)
            raise MethodError(f"{where}: field {name} of table {record.name} has the shape "
                              f"{values.shape}; its type in the record needs {needed}")


def place_of(path: Path, failure: BaseException) -> str:
    """Return "path:line", with the line that raised ``failure``; without it, if it is unknown."""
    if isinstance(failure, SyntaxError) and failure.lineno:
        return f"{failure.filename}:{failure.lineno}"
    lines = [frame.lineno for frame in traceback.extract_tb(failure.__traceback__)
             if frame.filename == str(path)]
    return f"{path}:{lines[-1]}" if lines else str(path)


def message_of(failure: BaseException) -> str:
    """Return the message of an exception in one line."""
    text = failure.msg if isinstance(failure, SyntaxError) else str(failure)
    return " ".join(text.split()) or "no message"
