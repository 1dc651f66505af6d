"""A disk on which, from one moment on, nothing happens any more: not even cleaning up."""

import contextlib
from pathlib import Path

from echousd.folder import folder as folders


@contextlib.contextmanager
def stopped_disk(monkeypatch, operations, error):
    """Let so many operations on the disk through; every later one, and the block, ends with `error`."""
    done = 0

    def counted(real):
        def call(*args, **kwargs):
            nonlocal done
            done += 1
            if done > operations:
                raise error
            return real(*args, **kwargs)

        return call

    with monkeypatch.context() as patch, contextlib.suppress(error):
        for name in ("write_bytes", "write_text", "replace", "mkdir", "unlink"):
            patch.setattr(Path, name, counted(getattr(Path, name)))
        patch.setattr(folders.shutil, "rmtree", counted(folders.shutil.rmtree))
        yield
