"""Declared sizes: checks the header of a mesh file before trimesh reads the file."""
from __future__ import annotations

import base64
import binascii
import json
import os
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from ..disk.budget import check_bytes, check_triangles
from ..disk.files import is_file, open_input, read_input
from .mesh_material import check_image

MOST_HEADER = 1 << 20       # largest PLY header that is read, bytes
_PLY_BYTES = {"char": 1, "uchar": 1, "int8": 1, "uint8": 1, "short": 2, "ushort": 2, "int16": 2,
              "uint16": 2, "int": 4, "uint": 4, "int32": 4, "uint32": 4, "float": 4,
              "float32": 4, "double": 8, "float64": 8}
_COMPONENT_BYTES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
_COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}


def check_declared(path: Path) -> None:
    """Check a mesh file before it is read.

    Raises
    ------
    ValueError
        the file is truncated, or its header declares more data than the file holds
    SceneError
        a texture of the file cannot be read; trimesh would silently omit the texture
    LimitError
        the decoded mesh would exceed the memory budget
    """
    size = os.stat(path).st_size
    if size == 0:
        raise ValueError("the file is empty")
    check = _CHECKS.get(path.suffix.lower())
    if check is not None:
        check(path, size)


def _check_stl(path: Path, size: int) -> None:
    if not is_text_stl(path) and (size < 84 or size < 84 + 50 * _stl_count(path)):
        raise ValueError(f"{size} bytes are fewer than its header promises")


def is_text_stl(path: Path) -> bool:
    """Return whether an STL file is text. Raise ValueError for a truncated text file."""
    with open_input(path) as file:
        head = file.read(84)
        file.seek(-min(os.fstat(file.fileno()).st_size, 256), os.SEEK_END)
        tail = file.read().lower()
    # A binary STL may also begin with "solid", but has zero bytes near its end.
    text = head.lstrip()[:5].lower() == b"solid" and b"\0" not in tail
    if text and b"endsolid" not in tail:
        raise ValueError("no endsolid at its end")
    return text


def _stl_count(path: Path) -> int:
    with open_input(path) as file:
        return int.from_bytes(file.read(84)[80:], "little")


# PLY --------------------------------------------------------------------------------------------

def ply_header(path: Path) -> bytes:
    """Return the header of a PLY file. Raise ValueError if it has no end_header."""
    header = b""
    with open_input(path) as file:
        while len(header) < MOST_HEADER:
            line = file.readline(MOST_HEADER)
            header += line
            if not line:
                break
            if line.split() == [b"end_header"]:
                return header
    raise ValueError("its header has no end_header")


def ply_faces(header: bytes) -> int:
    """Return the number of faces that a PLY header declares."""
    return next((int(words[2]) for words in map(bytes.split, header.splitlines())
                 if words[:2] == [b"element", b"face"]), 0)


def _check_ply(path: Path, size: int) -> None:
    header = ply_header(path)
    lines = header.decode("utf-8", "replace").splitlines()
    ascii_ = any(line.split()[:2] == ["format", "ascii"] for line in lines)
    needed, count, name = 0, 0, ""
    for line in lines:
        words = line.split()
        if words[:1] == ["element"] and len(words) == 3:
            name, count = words[1], int(words[2])
            if not 0 <= count <= size:
                raise ValueError(f"its header declares {count} {name} elements, but the file has "
                                 f"{size} bytes")
        elif words[:1] == ["property"] and len(words) > 2:
            # Add the smallest size of a value. In a text file, a digit and a separator need 2
            # bytes. A list may be empty, so add only the size of its length field.
            needed += count * (2 if ascii_ else _PLY_BYTES.get(
                words[2] if words[1] == "list" else words[1], 1))
        elif "texturefile" in line.lower() and words[:1] == ["comment"]:
            image = line[line.lower().index("texturefile") + len("texturefile"):].strip()
            if image:
                check_image(path, path.parent / image)
    if needed > size - len(header) + 1:     # the last line may lack its newline
        raise ValueError(f"its header declares {needed} bytes or more, but only "
                         f"{size - len(header)} follow")


# glTF -------------------------------------------------------------------------------------------

def _check_gltf(path: Path, size: int) -> None:
    with open_input(path) as file:
        content = file.read(size)
    inner = 0       # bytes of the binary chunk, which holds the buffer without a URI
    if content[:4] == b"glTF":
        length = int.from_bytes(content[12:16], "little")
        text = content[20:20 + length]
        if len(text) < length:
            raise ValueError("the file is truncated")
        inner = size - 20 - length
    else:
        text = content
    try:
        tree = json.loads(text.decode("utf-8-sig"))
    except RecursionError:
        raise ValueError("brackets nested too deeply") from None
    try:
        _check_tree(path, tree, size, inner)
    except (KeyError, IndexError, TypeError, AttributeError, OverflowError) as failure:
        raise ValueError(f"its JSON contradicts itself ({failure!r})") from None


def _check_tree(path: Path, tree: Mapping[str, Any], size: int, inner: int) -> None:
    for image in tree.get("images", []):
        uri = image.get("uri", "")
        if uri and not uri.startswith("data:"):
            plain = path.parent / unquote(uri)
            check_image(path, plain if is_file(plain) else path.parent / uri)
    buffers = [_buffer_bytes(path, entry, inner) for entry in tree.get("buffers", [])]
    views = tree.get("bufferViews", [])
    for k, view in enumerate(views):
        first, length = _whole(view.get("byteOffset", 0)), _whole(view["byteLength"])
        if first + length > buffers[_whole(view["buffer"])]:
            raise ValueError(f"bufferViews[{k}] ends after its buffer")
    accessors = tree.get("accessors", [])
    sizes = [_accessor_bytes(k, entry, views, sum(buffers)) for k, entry in enumerate(accessors)]
    positions, corners = 0, 0
    for mesh in tree.get("meshes", []):
        for primitive in mesh.get("primitives", []):
            points = accessors[_whole(primitive["attributes"]["POSITION"])]["count"]
            positions += points
            corners += (accessors[_whole(primitive["indices"])]["count"]
                        if "indices" in primitive else points)
    # trimesh decodes positions to float64 and indices to int64. Primitives that share data do not
    # share the decoded arrays.
    stored = size + sum(buffers)
    check_bytes(sum(sizes) + sum(view["byteLength"] for view in views) + 24 * positions, stored,
                str(path))
    if 2 * corners > stored:
        check_triangles(corners // 3, str(path))


def _buffer_bytes(path: Path, entry: Mapping[str, Any], inner: int) -> int:
    uri = entry.get("uri")
    if uri is None:
        return inner
    if "base64," in uri:
        try:
            return len(base64.b64decode(uri[uri.index("base64,") + 7:]))
        except binascii.Error as failure:
            raise ValueError(f"a buffer's base64 is broken ({failure})") from None
    plain = path.parent / unquote(uri)
    return os.stat(plain if is_file(plain) else path.parent / uri).st_size


def _accessor_bytes(k: int, entry: Mapping[str, Any], views: Any, there: int) -> int:
    count = _whole(entry["count"])
    each = _COMPONENT_BYTES[entry["componentType"]] * _COMPONENTS[entry["type"]]
    if "bufferView" in entry:
        view = views[_whole(entry["bufferView"])]
        stride = _whole(view.get("byteStride", each)) or each
        there = view["byteLength"] - _whole(entry.get("byteOffset", 0))
        needed = (count - 1) * stride + each if count else 0
    else:
        # An accessor without a view is filled with zeros, so even a small file could declare a
        # huge accessor. Limit the count to the number of bytes in all buffers.
        needed = count
    if needed > there:
        raise ValueError(f"accessors[{k}] declares {count} values, but its data holds fewer")
    return count * each


def _whole(value: Any) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or value < 0:
        raise ValueError(f"its JSON has {str(value)[:40]} instead of a whole number")
    return value


# Archives ---------------------------------------------------------------------------------------

def _check_zip(path: Path, size: int) -> None:
    with open_input(path) as file, zipfile.ZipFile(file) as archive:
        check_bytes(sum(info.file_size for info in archive.infolist()), size, str(path))


def _check_stream(path: Path, size: int) -> None:
    import bz2
    import gzip
    opener = gzip.open if path.suffix.lower() == ".gz" else bz2.open
    found = 0
    with open_input(path) as file, opener(file) as content:
        while block := content.read(1 << 20):
            found += len(block)
            check_bytes(found, size, str(path))


_CHECKS: Mapping[str, Callable[[Path, int], None]] = {
    ".stl": _check_stl, ".ply": _check_ply, ".gltf": _check_gltf, ".glb": _check_gltf,
    ".zip": _check_zip, ".3mf": _check_zip, ".3dxml": _check_zip, ".zae": _check_zip,
    ".gz": _check_stream, ".bz2": _check_stream}


def whole_text(path: Path) -> bytes | None:
    """Return the content of a file whose text is not UTF-8, with the text converted to UTF-8 for
    trimesh; None for any other file. In a binary STL, zeros replace the text of the header."""
    suffix = path.suffix.lower()
    if suffix == ".ply":
        header = ply_header(path)
        if _is_utf8(header):
            return None
        return header.decode("latin-1").encode() + read_input(path)[len(header):]
    if suffix == ".stl" and not is_text_stl(path):
        with open_input(path) as file:
            head = file.read(80)
        return None if _is_utf8(head) else bytes(80) + read_input(path)[80:]
    if suffix in (".stl", ".off", ".xyz", ".dae", ".xaml"):
        content = read_input(path)
        return None if _is_utf8(content) else content.decode("latin-1").encode()
    return None


def _is_utf8(content: bytes) -> bool:
    try:
        content.decode()
    except UnicodeDecodeError:
        return False
    return True
