"""Processes that die: at one of their operations on the disk, after which nothing happens, or killed at some moment."""

import contextlib
import itertools
import os
import signal
import time
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


def killed(act, delay):
    """Call `act` over and over, with 0, 1, 2 ..., in a fork of this process; kill that so many seconds after it began.

    A fork need not import everything again.
    """
    begun, begins = os.pipe()
    child = os.fork()
    if not child:
        try:
            os.write(begins, b"go")
            for number in itertools.count():
                act(number)
        finally:  # what `act` raises ends the fork, and not by a signal
            os._exit(70)
    assert os.read(begun, 2) == b"go"
    time.sleep(delay)
    os.kill(child, signal.SIGKILL)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == -signal.SIGKILL
    os.close(begun)
    os.close(begins)


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
