"""Help: the short help fits a screen, the help of a method lists the method's options, and
--help-all lists every option."""
from __future__ import annotations

import re

import pytest

from gpgpu_rt.cli.main import MODULES, command_parser, main
from gpgpu_rt.methods import find_method, methods
from gpgpu_rt.options import TRACER_OPTIONS
from gpgpu_rt.render.integrators import INTEGRATORS

SCREEN = 52     # lines of a terminal at 80 columns
LONG = ["render", "trace", "bench", "passes", "heat", "program", "accuracy", "view"]


@pytest.fixture
def told(capsys, monkeypatch):
    """Returns a function that runs a command and returns its standard output."""
    monkeypatch.setenv("COLUMNS", "80")

    def run(*words: str) -> str:
        with pytest.raises(SystemExit) as end:
            main(words)
        assert end.value.code == 0
        return capsys.readouterr().out
    return run


def words_in(text: str) -> set[str]:
    """Returns the long options, such as --octants, that begin a line of a help text. A short form
    such as -m may precede the long option."""
    return set(re.findall(r"^  (?:-\w(?: \S+)?, )?(--[a-z-]+)", text, re.M))


def words_of(options) -> set[str]:
    return {"--" + option.name.replace("_", "-") for option in options}


@pytest.mark.parametrize("command", MODULES)
def test_help_fits_a_screen(told, command: str) -> None:
    assert len(told(command, "--help").splitlines()) <= SCREEN


def test_the_commands_with_tables_of_options_are_known() -> None:
    parsers = {name: command_parser(
        name)._subparsers._group_actions[0].choices[name] for name in MODULES}
    assert [name for name, parser in parsers.items() if parser.owned] == LONG


@pytest.mark.parametrize("command", LONG)
def test_help_all_lists_every_option(told, command: str) -> None:
    """--help-all lists every option. --help lists the common options of the tracer and all but a
    few of the command's own options."""
    short, full = words_in(told(command, "--help")), words_in(told(command, "--help-all"))
    table = words_of(TRACER_OPTIONS).union(*(words_of(row.options) for row in methods()))
    assert table <= full and "--help-all for every option." in told(command, "-h")
    common = words_of(option for option in TRACER_OPTIONS if option.common)
    own = full - table - words_of(o for kind in INTEGRATORS.values() for o in kind.options)
    assert common <= short and short & table == common and short <= full
    assert own - short <= {"--up", "--settings", "--force", "--timings", "--first-hits",
                           "--resume", "--build-ahead", "--scheduler", "--explain"}


@pytest.mark.parametrize("name", [row.name for row in methods()])
def test_a_method_has_a_help_of_its_own(told, name: str) -> None:
    own = words_of(find_method(name).options)
    for words in (["render", "-m", name, "--help"], ["render", "-h", f"--method={name}"],
                  ["program", name, "--help"]):
        text = told(*words)
        assert words_in(text) == own
        assert f"options of method {name}:{'' if own else ' none'}\n" in text
    assert not re.search("|".join(f"{row.name}:" for row in methods() if row.name != name),
                         text.replace(f"method {name}:", ""))     # no text of another method


@pytest.mark.parametrize("name", INTEGRATORS)
def test_an_integrator_has_a_help_of_its_own(told, name: str) -> None:
    text = told("render", "--integrator", name, "--help")
    assert words_in(text) == words_of(INTEGRATORS[name].options)


def test_several_methods_and_auto(told) -> None:
    """The help of several methods lists the options of each. `auto` gives the short help."""
    text = told("bench", "--help", "-m", "grid,bvh-packet")
    assert text.index("options of method grid:") < text.index("options of method bvh-packet:")
    assert "default 5.0\n" in text and "for ray-engine" not in text
    assert told("render", "-m", "auto", "--help") == told("render", "--help")
    assert told("render", "--help", "-m") == told("render", "--help")


def test_a_wrong_name_is_one_line(capsys) -> None:
    assert main(["render", "-m", "kd-restrat", "--help"]) == 1
    assert capsys.readouterr().err == ("gpgpu-rt: no method 'kd-restrat'; did you mean kd-restart "
                                       "or kd-stack or kd-ropes?\n")


@pytest.mark.parametrize("command, schedule", [("passes", "step"), ("heat", "loop")])
def test_the_help_names_the_default_schedule(told, command: str, schedule: str) -> None:
    assert f"(kernels, step, loop); default {schedule}" in " ".join(told(command, "-h").split())
