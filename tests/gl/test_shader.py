"""Tests of includes, and of errors with file and line. GLSL files have version 3.30, except
era/card.frag (1.20). GLSL files use no feature that programs of 2002-2007 lacked: compute shaders,
geometry shaders, storage buffers, image stores or doubles."""
from __future__ import annotations

import re
from pathlib import Path

import pytest

import gpgpu_rt as rt
from gpgpu_rt.gl import shader
from gpgpu_rt.gl.context import Gpu, open_gpu
from gpgpu_rt.gl.full_screen import FullScreenPass
from gpgpu_rt.gl.shader import ROOT, compile_program, resolve
from gpgpu_rt.gl.textures import make_texture, read_texture
from gpgpu_rt.methods import find_method
from gpgpu_rt.options import TRACER_OPTIONS

FILES = [p for p in sorted(ROOT.rglob("*")) if p.suffix in (".glsl", ".frag", ".vert")]
BANNED = {
    "compute": r"local_size_x", "storage buffer": r"layout\s*\(\s*std430|\bbuffer\b",
    "image store": r"\bimage(Load|Store|Atomic)", "double": r"\bdouble\b|\bdvec[234]\b|\bdmat",
    "not in GLSL 330": r"\b(packHalf2x16|bitCount|findMSB|umulExtended|fma)\s*\(",
    "geometry shader": r"EmitVertex",
}
pytestmark = pytest.mark.small


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.name)
def test_files_use_no_later_features(path) -> None:
    code = re.sub(r"//[^\n]*|/\*.*?\*/", "", path.read_text(), flags=re.S)
    for what, pattern in BANNED.items():
        assert not re.search(pattern, code), f"{path.name}: {what}"
    for version in re.findall(r"#\s*version\s+(.*)", code):
        # Only the cards' compilers read era/card.frag.
        assert version.split()[0] == ("120" if path.name == "card.frag" else "330")
    if path.parent.name != "core":   # outside core/, only generated accessors compute addresses
        assert not re.search(r"texelFetch\([^)]*\*", code)


# Headers of users' own methods, whose files have absolute paths, need not name a paper.
@pytest.mark.parametrize("method", [row.name for row in rt.methods()
                                    if not Path(row.glsl).is_absolute()])
def test_headers_name_their_paper(method: str) -> None:
    header = (ROOT / find_method(method).glsl).read_text().split("\n\n")[0]
    assert header.startswith("//") and re.search(r"\b(19|20)\d\d\b", header)


@pytest.mark.parametrize("row", [row for row in rt.methods() if row.parts], ids=lambda r: r.name)
def test_options_choose_files_that_are_there(row) -> None:
    known = {option.name for option in (*row.options, *TRACER_OPTIONS)}
    for part in row.parts:
        assert all((ROOT / file).is_file() for file in (part.plain, *part.files.values()))
        assert part.file({}) == part.plain
        if part.option in known:
            assert all(part.file({part.option: value}) == file
                       for value, file in part.files.items())


@pytest.mark.parametrize("path", [p for p in FILES if {"methods", "drivers"} & set(p.parts)],
                         ids=lambda p: p.name)
def test_programs_have_few_conditional_lines_and_nest_none(path) -> None:
    count = depth = 0
    for line in path.read_text().splitlines():
        word = re.match(r"\s*#\s*(if|ifdef|ifndef|elif|else|endif)\b", line)
        if word:
            count += word[1] != "endif"
            depth += word[1].startswith("if") - (word[1] == "endif")
        assert depth <= 1, f"{path.name}: {line.strip()} is nested"
    assert count <= 8


def write(folder, **files: str) -> str:
    for name, text in files.items():
        (folder / f"{name}.glsl").write_text(text)
    return str(folder / "main.glsl")


def test_nested_includes_once_each(tmp_path) -> None:
    main = write(tmp_path, main=f'#version 330 core\n#include "{tmp_path}/a.glsl"\n'
                 f'#include "{tmp_path}/b.glsl"\nint end;\n',
                 a=f'#include "{tmp_path}/b.glsl"\nint a;\n', b="int b;\n")
    source = resolve(main, {"K": 3, "ON": True, "OFF": False, "NO": None})
    assert source.text.count("int b;") == 1 and source.text.count("int a;") == 1
    assert "#define K 3\n" in source.text and "#define ON\n" in source.text
    assert "OFF" not in source.text and "NO" not in source.text
    assert source.text.splitlines()[0] == "#version 330 core"


def test_include_errors(tmp_path) -> None:
    main = write(tmp_path, main=f'#include "{tmp_path}/a.glsl"\n',
                 a=f'#include "{tmp_path}/main.glsl"\n')
    with pytest.raises(rt.ShaderError, match="cycle"):
        resolve(str(tmp_path / "a.glsl"))
    with pytest.raises(rt.ShaderError, match=r"main.glsl:1: cannot read .*gone"):
        resolve(write(tmp_path, main='#include "gone.glsl"\n'))
    with pytest.raises(rt.ShaderError, match=r"main.glsl:2: nothing was generated for <x>"):
        resolve(write(tmp_path, main="\n#include <x>\n"))
    assert main


def test_compile_error_names_file_line_and_defines(tmp_path) -> None:
    write(tmp_path, bad="int fine;\nfloat f() {\n    float x = 1.0;\n    x += undeclared_name;\n"
          "    return x;\n}\n")
    main = write(tmp_path, main=f'#version 330 core\nout vec4 c;\n#include "{tmp_path}/bad.glsl"\n'
                 "void main() { c = vec4(f()); }\n")
    with pytest.raises(rt.ShaderError, match=r"bad.glsl:4:.*undeclared_name.*MARK 7"):
        compile_program(open_gpu(), main, {"MARK": 7})


def test_compile_error_of_the_vertex_program_names_its_file(tmp_path) -> None:
    write(tmp_path, main="#version 330 core\nout vec4 c;\nvoid main() { c = vec4(1.0); }\n")
    vertex = tmp_path / "corner.vert"
    vertex.write_text("#version 330 core\n\nvoid main() { gl_Position = vec4(gone); }\n")
    with pytest.raises(rt.ShaderError, match=r"corner.vert:3:.*gone"):
        compile_program(open_gpu(), str(tmp_path / "main.glsl"), vertex=str(vertex))


def test_unused_programs_leave_the_cache(tmp_path, monkeypatch, gpu: Gpu) -> None:
    """The cache keeps all programs in use, and drops the unused programs that were requested
    longest ago."""
    monkeypatch.setattr(shader, "MOST_PROGRAMS", 10)
    monkeypatch.setattr(gpu, "programs", {})    # leave out the programs of other tests
    (tmp_path / "number.frag").write_text(
        "#version 330 core\nout vec4 value;\nvoid main() { value = vec4(NUMBER); }\n")

    def made(number: int) -> FullScreenPass:
        return FullScreenPass(gpu, str(tmp_path / "number.frag"), {"NUMBER": number})
    with gpu:
        held = [made(number) for number in range(12)]
        for number in range(100, 130):
            made(number)
        assert len(gpu.programs) == 13 and made(129).program is list(gpu.programs.values())[-1]
        del held[3:]
        made(1)
        made(200)
        assert len(gpu.programs) == 10
        texture = make_texture(gpu, (4, 4), 4, "test")
        target = gpu.context.framebuffer([texture])
        for number, one in enumerate(held):
            one.draw(target, {})
            assert (read_texture(texture) == number).all()
        gpu.release(target)
        texture.release()
