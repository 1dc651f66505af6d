"""The commands in the README are executed, top to bottom, in one folder that holds a copy of samples/.

The examples on the page of the API are executed in this process, top to bottom, in an empty folder.

Every ```bash and ```python block runs, except

* blocks below a comment `<!-- not run: reason -->`,
* `make` commands (they set up the environment that these tests run in).

Python and lines that call `echousd` with plain words run in this process, which has loaded what they want and draws
small pictures; a block that begins with something else (the first one does) runs in a shell, with the command on its
PATH.

A ```text block below a comment `<!-- output -->` must be what the block above it printed; a line `...` in it stands for
any number of lines.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import chdir, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from functools import partial
from io import StringIO
from pathlib import Path
from unittest.mock import patch

import pytest
from few_cameras import FEW
from inline_batches import Inline

from echousd.cli import main as commands
from echousd.draw import rendering

REPOSITORY = Path(__file__).parents[1]
README = REPOSITORY / "README.md"
FENCE = re.compile(r"^(?P<indent> *)```(?P<language>\w*)\s*$")
SECONDS = 600


@pytest.fixture(autouse=True, scope="module")
def pictures_are_small() -> Iterator[None]:
    """Commands that do not say how large a picture is draw small ones; a shell's draw their own size."""
    sizes = {name: (size // 5, rays) for name, (size, rays) in rendering.QUALITIES.items()}
    with patch.dict(rendering.QUALITIES, sizes), patch("echousd.make.save.PREVIEW", 96):
        yield


@pytest.fixture(autouse=True, scope="module")
def rooms_are_made_of_few_drafts() -> Iterator[None]:
    """One draft a room, and its cameras are looked for at a dozen places."""
    with (
        patch("echousd.make.furnishing.most_drafts", lambda model, objects: 1),
        patch.multiple("echousd.draw.views", **FEW),
    ):
        yield


@pytest.fixture(autouse=True, scope="module")
def rooms_are_made_here() -> Iterator[None]:
    """Rooms of homes and batches are made in this process, and not by workers that import everything first."""
    with (
        patch("echousd.home.assemble.LocalWorkers", lambda *_, **__: Inline()),
        patch("echousd.batches.batch._executor", lambda how, rooms, device: Inline()),
    ):
        yield


@dataclass(frozen=True)
class Block:
    """A fenced block with the comment that stands above it."""

    line: int
    language: str
    text: str
    comment: str


def blocks(markdown: str) -> list[Block]:
    """All fenced blocks of a Markdown text."""
    found, comment, inside = [], "", None
    for number, line in enumerate(markdown.splitlines(), 1):
        fence = FENCE.match(line)
        if inside is not None:
            if fence and not fence["language"]:
                start, language, _, lines = inside
                found.append(Block(start, language, "\n".join(lines) + "\n", comment))
                comment, inside = "", None
            else:
                inside[3].append(line.removeprefix(inside[2]))
        elif fence:
            inside = (number, fence["language"], fence["indent"], [])
        elif line.strip():
            note = re.fullmatch(r"\s*<!--\s*(.*?)\s*-->\s*", line)
            comment = note[1] if note else ""
    assert inside is None, f"the block in line {inside and inside[0]} is not closed"
    return found


def steps(block: Block) -> list[Callable[[], int]]:
    """What runs a block, one after the other, each for its exit code: nothing for a block that is not to be run."""
    if block.comment.startswith("not run:") or block.language not in ("bash", "python"):
        return []
    if block.language == "python":
        return [partial(python, block.text)]
    lines = [line for line in block.text.splitlines() if line.strip() and not re.match(r"\s*make\b", line)]
    if not lines or not lines[0].startswith("echousd "):
        return [partial(shell, "\n".join(lines))] if lines else []
    return [
        partial(shell, line) if set(line.partition("#")[0]) & set("|<>;&$") else partial(command, line)
        for line in lines
    ]


def command(line: str) -> int:
    """Run a line that calls `echousd`, or one that is a remark."""
    words = shlex.split(line, comments=True)
    return commands.run(words[1:]) if words else 0


def shell(text: str) -> int:
    """Run a text in a shell that stops at the first failure; its exit code."""
    paths = [str(Path(sys.executable).parent), os.environ["PATH"]]
    environment = {**os.environ, "PATH": os.pathsep.join(paths), "NO_COLOR": "1", "PYTHONIOENCODING": "utf-8"}
    done = subprocess.run(
        ["bash", "-euo", "pipefail", "-c", text],
        env=environment, capture_output=True, text=True, timeout=SECONDS, encoding="utf-8",
    )  # fmt: skip
    sys.stdout.write(done.stdout)
    sys.stderr.write(done.stderr)
    return done.returncode


def python(text: str) -> int:
    """Run a text as Python, with names of its own; its exit code."""
    try:
        exec(text, {})
    except Exception:
        traceback.print_exc()
        return 1
    return 0


def run(markdown: str, folder: Path) -> int:
    """Run the blocks of `markdown` in `folder`; the number of blocks that ran. Fails at the first that fails."""
    count, printed = 0, ""
    for block in blocks(markdown):
        if block.comment == "output":
            pattern = "".join(
                r"(?:.*\n)*?" if line.strip() == "..." else re.escape(line.rstrip()) + r"[ \t]*\n"
                for line in block.text.splitlines()
            )
            assert re.fullmatch(pattern, printed), f"README line {block.line}: printed was\n{printed}"
        parts, out, errors = steps(block), StringIO(), StringIO()
        if not parts:
            continue
        with chdir(folder), redirect_stdout(out), redirect_stderr(errors):
            code = next(filter(None, (part() for part in parts)), 0)
        printed = out.getvalue()
        assert code == 0, f"README line {block.line}: exit code {code}\n{printed}{errors.getvalue()}"
        count += 1
    return count


@pytest.mark.skipif(not README.exists(), reason="no README.md in this checkout")
def test_the_commands_in_the_readme_run(tmp_path):
    shutil.copytree(REPOSITORY / "samples", tmp_path / "samples")
    assert run(README.read_text("utf-8"), tmp_path) >= 3


def test_the_examples_on_the_page_of_the_api_run(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    page = REPOSITORY / "docs" / "API.md"
    shown = [block for block in blocks(page.read_text("utf-8")) if block.language == "python"]
    for block in shown:
        exec(compile(block.text, f"{page.name}, block of line {block.line}", "exec"), {})
    assert len(shown) == 5
    printed = capsys.readouterr().out
    assert printed.startswith("+ object lamp (table_lamp)\n+ relation lamp standing_on desk\n")
    assert "/Room out/study/study.usda\n" in printed
    assert "+ object shelf (bookshelf)\n" in printed  # which was taken back


@pytest.mark.skipif(not README.exists(), reason="no README.md in this checkout")
def test_the_readme_begins_with_make():
    shown = [block for block in blocks(README.read_text("utf-8")) if block.language == "bash"]
    assert re.findall(r"^make \w+", shown[0].text, re.MULTILINE)[:2] == ["make room", "make test"]


# -- the runner itself -------------------------------------------------------------------------------------------------


def test_blocks_run_in_order_in_one_folder(tmp_path):
    markdown = (
        "```bash\nmake room\necho hello > a.txt  # words\n```\n\n* in a list\n\n  ```python\n"
        "  if True:\n      print(open('a.txt').read() * 3)\n  ```\n\n<!-- output -->\n```text\nhello\n...\n\n```\n"
        "```yaml\nnot: run\n```\n"
    )
    assert run(markdown, tmp_path) == 2
    assert (tmp_path / "a.txt").read_text() == "hello\n"


def test_marked_blocks_and_make_do_not_run(tmp_path):
    assert (
        run("<!-- not run: needs a GPU -->\n\n```bash\nexit 3\n```\n```bash\nmake room\nmake test\n```\n", tmp_path)
        == 0
    )


def test_a_remark_counts_for_the_next_block_alone(tmp_path):
    markdown = "<!-- not run: slow -->\n```bash\nexit 3\n```\n```bash\nexit 4\n```\n"
    with pytest.raises(AssertionError, match="README line 5: exit code 4"):
        run(markdown, tmp_path)


WRONG = ["bash\nfalse\ntrue", "bash\nfalse | true", "python\nraise ValueError", "bash\nechousd graph no.usda | cat",
         "bash\nechousd graph no.usda\nechousd plugin-path"]  # fmt: skip


@pytest.mark.parametrize("block", WRONG)
def test_a_block_that_fails_fails_the_test(tmp_path, block):
    with pytest.raises(AssertionError, match=r"README line 1: exit code [12]"):
        run(f"```{block}\n```\n", tmp_path)


def test_other_output_fails_the_test(tmp_path):
    with pytest.raises(AssertionError, match=r"README line 5: printed was\n +b"):
        run("```bash\necho b\n```\n<!-- output -->\n```text\na\n```\n", tmp_path)
