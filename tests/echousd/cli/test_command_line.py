"""The command line as a whole: exit codes, one-line errors, --debug, --version, completion and a fast start."""

from __future__ import annotations

import os
import re
import resource
import subprocess
import sys
import warnings

import pytest
import typer

import echousd
from echousd.cli import main
from echousd.cli.options import SAID
from echousd.cli.output import counted


def started(*words: str, environment: dict[str, str] | None = None) -> subprocess.CompletedProcess[str]:
    """`echousd` in a process of its own."""
    code = "import sys; from echousd.cli.main import main; sys.argv[0] = 'echousd'; main()"
    variables = {**os.environ, "NO_COLOR": "1", **(environment or {})}
    return subprocess.run([sys.executable, "-c", code, *words], capture_output=True, text=True, env=variables)


def test_version(echousd_command):
    assert echousd_command("--version").out == f"echousd {echousd.__version__}\n"


def test_help_without_words(echousd_command):
    outcome = echousd_command()
    assert outcome.code == 0
    assert "Usage: echousd" in outcome.out
    assert "graph" in outcome.out


def commands(group, path=()):
    for name, command in group.commands.items():
        if hasattr(command, "commands"):
            yield from commands(command, (*path, name))
        else:
            yield " ".join((*path, name)), command


def test_every_command_has_help_with_an_example():
    for name, command in commands(main.command()):
        text = f"{command.help}\n{command.epilog}"
        assert f"echousd {name}" in text, f"{name} shows no example"


def test_every_argument_and_option_says_what_it_is():
    found = dict(commands(main.command()))
    assert found.keys() == SAID.keys()
    silent = [f"{name} {one.name}" for name, command in found.items() for one in command.params if not one.help]
    assert silent == []
    sizes = next(one for one in found["new"].params if one.name == "size")
    assert (sizes.opts, sizes.nargs, sizes.metavar) == (["--size"], 2, "X Z")
    workers = next(one for one in found["assets index"].params if one.name == "workers")
    assert workers.default == 0
    with pytest.raises(Exception, match="should be less than or equal to 256"):
        found["assets index"].make_context("index", ["models", "-o", "a.parquet", "--workers", "257"])
    rooms = next(one for one in found["new"].params if one.name == "room")
    assert [one.value for one in rooms.shell_complete(None, "bed")] == ["bedroom"]


def test_help_says_units_and_frame(echousd_command):
    told = " ".join(echousd_command("generate", "--help").out.split())
    for words in ("lengths are metres", "+Y up", "`90 deg` or radians about +Y"):
        assert words in told.replace("│ ", "").replace(" │", "")


def test_the_start_loads_nothing_heavy_and_is_fast():
    code = (
        "import sys\nfrom echousd.cli.main import run\nrun(['--help'])\n"
        "heavy = ('torch', 'pxr', 'numpy', 'scipy', 'pydantic', 'matplotlib', 'trimesh', 'shapely', 'networkx')\n"
        "print('loaded', [name for name in heavy if name in sys.modules])"
    )
    seconds = []
    for _ in range(3):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        seconds.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    assert done.stdout.splitlines()[-1] == "loaded []"
    assert min(seconds) < 1.0  # of processor time; 0.2 on a free machine


def test_a_warning_steers_no_terminal(monkeypatch):
    monkeypatch.setattr(warnings, "formatwarning", warnings.formatwarning)  # as it was, afterwards
    monkeypatch.setattr(sys, "argv", ["echousd", "--version"])
    with pytest.raises(SystemExit):
        main.main()
    assert warnings.formatwarning("made with \x1b[31m", UserWarning, "", 0) == "warning: made with \\x1b[31m\n"


def test_threads_wait_asleep_unless_somebody_says_otherwise(monkeypatch):
    monkeypatch.setattr(warnings, "formatwarning", warnings.formatwarning)  # as it was, afterwards
    monkeypatch.setenv("OMP_WAIT_POLICY", "")
    for said, found in ((None, "PASSIVE"), ("ACTIVE", "ACTIVE")):
        monkeypatch.delenv("OMP_WAIT_POLICY")
        if said is not None:
            monkeypatch.setenv("OMP_WAIT_POLICY", said)
        monkeypatch.setattr(sys, "argv", ["echousd", "--version"])
        with pytest.raises(SystemExit):
            main.main()
        assert os.environ["OMP_WAIT_POLICY"] == found


def test_errors_are_one_line_and_code_2(tmp_path):
    done = started("graph", str(tmp_path / "gone.yaml"))
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == f"error: {tmp_path}/gone.yaml: no such file or directory\n"


@pytest.mark.parametrize("words", [("--debug", "graph", "gone.yaml"), ("graph", "gone.yaml", "--debug")])
def test_debug_shows_the_traceback_wherever_it_stands(echousd_command, words):
    outcome = echousd_command(*words)
    assert outcome.code == 2
    assert "Traceback (most recent call last)" in outcome.err
    assert outcome.err.endswith("error: gone.yaml: no such file or directory\n")


def test_words_after_a_double_dash_are_no_options(echousd_command):
    outcome = echousd_command("graph", "--", "--debug")
    assert outcome.err.startswith("error: --debug: extension ''")


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("grpah",), "error: No such command 'grpah'"),
        (("--foo",), "error: No such option: --foo"),
        (("graph", "a.yaml", "--jsn"), "error: No such option: --jsn"),
        (("new",), "error: Missing argument 'OUT' (try: echousd new --help)"),
        (("new", "a.usda", "--size", "x", "y", "--room", "bedroom"), "error: Invalid value for '--size'"),
    ],
)
def test_wrong_command_lines(echousd_command, words, text):
    outcome = echousd_command(*words)
    assert outcome.code == 2
    assert outcome.err.startswith(text)
    assert outcome.err.count("\n") == 1


@pytest.mark.parametrize(
    ("error", "code", "text"),
    [
        (ValueError("two\nlines"), 2, "error: two lines\n"),
        (PermissionError(13, "Permission denied", "/x/y.usda"), 2, "error: /x/y.usda: Permission denied\n"),
        (ModuleNotFoundError("for pictures: pip install 'echousd[render]'"), 2, "error: for pictures: pip install"),
        (KeyError("x"), 70, "error: unexpected KeyError: 'x' (a fault of echousd; --debug shows where)\n"),
        (KeyboardInterrupt(), 130, "error: interrupted\n"),
        (typer.Abort(), 130, "error: interrupted\n"),
        (typer.Exit(1), 1, ""),
    ],
)
def test_exit_codes(monkeypatch, capsys, error, code, text):
    app = typer.Typer()

    @app.callback()
    def options() -> None: ...

    @app.command()
    def fail() -> None:
        raise error

    monkeypatch.setattr(main, "command", lambda: typer.main.get_command(app))
    assert main.run(["fail"]) == code
    assert capsys.readouterr().err.startswith(text)


def test_a_closed_pipe_is_silent():
    code = "from echousd.cli.main import run; import sys; sys.exit(run(['--help']))"
    done = subprocess.run(
        ["bash", "-c", f'set -o pipefail; "{sys.executable}" -c "{code}" | true; echo "${{PIPESTATUS[0]}}"'],
        capture_output=True,
        text=True,
    )
    assert done.stdout.strip() == "141"  # what the shell reports of a program that SIGPIPE ended
    assert "Traceback" not in done.stderr
    assert "error" not in done.stderr


def test_a_standard_output_that_was_closed_is_no_fault():
    code = "import sys; from echousd.cli.main import main; sys.argv = ['echousd', '--help']; main()"
    done = subprocess.run(["bash", "-c", f'"{sys.executable}" -c "{code}" >&-'], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_of_commands(shell):
    words = {
        "bash": {"COMP_WORDS": "echousd gr", "COMP_CWORD": "1"},
        "zsh": {"_TYPER_COMPLETE_ARGS": "echousd gr"},
        "fish": {"_TYPER_COMPLETE_ARGS": "echousd gr", "_TYPER_COMPLETE_FISH_ACTION": "get-args"},
    }[shell]
    done = started(environment={"_ECHOUSD_COMPLETE": f"complete_{shell}", **words})
    assert re.search(r"\bgraph\b", done.stdout), done


def test_completion_of_words_of_the_vocabulary():
    environment = {
        "_ECHOUSD_COMPLETE": "complete_bash",
        "COMP_WORDS": "echousd new a.usda --room li",
        "COMP_CWORD": "4",
    }
    assert started(environment=environment).stdout.split() == ["living_room", "living_dining_room"]


@pytest.mark.parametrize("words", [("--help",), ("graph", "samples/bedroom.yaml"), ("graph", "gone.yaml")])
def test_no_colour_where_none_is_wanted(words):
    """NO_COLOR counts on a terminal, too (https://no-color.org)."""
    plain = started(*words, environment={"FORCE_COLOR": "1", "TERM": "xterm-256color", "NO_COLOR": "1"})
    assert not re.search(r"\x1b\[[0-9;]*3[0-7]m", plain.stdout + plain.stderr)


def test_one_is_no_plural():
    assert [counted(n, "object") for n in (0, 1, 2)] == ["0 objects", "1 object", "2 objects"]
