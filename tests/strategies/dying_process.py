"""Processes that die: at one of their operations on the disk, after which nothing happens, or killed at some moment."""

import contextlib
import os
import signal
import subprocess
import sys
from pathlib import Path
from unittest.mock import patch

OPERATIONS = ("unlink", "rmdir", "rename", "replace", "mkdir", "symlink", "link", "truncate", "ftruncate")


class Died(BaseException):
    """Stands for the process being gone."""


class Dying:
    """Counts the operations; `died` says whether the last of them was one too many."""

    def __init__(self, at):
        self.left, self.count, self.died = at, 0, False

    def step(self):
        if self.left is not None and self.count >= self.left:
            self.died = True
            raise Died
        self.count += 1


def killed(code, folder, delay):
    """Run a program that writes into a folder and says "go" before; kill it so many seconds after that."""
    variables = {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    process = subprocess.Popen([sys.executable, "-c", code, str(folder)], stdout=subprocess.PIPE, env=variables)
    assert process.stdout.readline() == b"go\n"
    try:
        process.wait(delay)
    except subprocess.TimeoutExpired:
        os.kill(process.pid, signal.SIGKILL)
        process.wait()
    process.stdout.close()


@contextlib.contextmanager
def dying(at):
    """Let `at` operations through (None = all); the next, a write by half, ends the block as the end of the process."""
    state, stack = Dying(at), contextlib.ExitStack()

    def counted(real):
        def call(*args, **kwargs):
            state.step()
            return real(*args, **kwargs)

        return call

    def half(real):
        def call(self, content, *args, **kwargs):
            try:
                state.step()
            except Died:
                if state.count == state.left and not state.left < 0:
                    real(self, content[: len(content) // 2], *args, **kwargs)
                    state.left = -1
                raise
            return real(self, content, *args, **kwargs)

        return call

    with stack:
        for name in OPERATIONS:
            stack.enter_context(patch.object(os, name, counted(getattr(os, name))))
        for name in ("write_bytes", "write_text"):
            stack.enter_context(patch.object(Path, name, half(getattr(Path, name))))
        with contextlib.suppress(Died):
            yield state
