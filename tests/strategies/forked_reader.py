"""The process that reads files of others first, forked from one that has imported OpenUSD, which takes 0.3 s each time.

Run by its path it is that process: it answers at a socket with the number and then the end of each fork.
"""

from __future__ import annotations

import io
import json
import os
import select
import signal
import socket
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import patch


@contextmanager
def readers_are_forked() -> Iterator[None]:
    """Within the block, `echousd.stage.apart` has its reader forked."""
    from echousd.stage import apart

    server: list[subprocess.Popen] = []
    owner, environment = os.getpid(), dict(os.environ)

    with tempfile.TemporaryDirectory(prefix="echousd-reader-") as folder:
        address = str(Path(folder) / "socket")

        def run(words, *, input, timeout, **options):
            if not server and os.getpid() == owner:
                command = [sys.executable, "-P", __file__, str(apart.READER), address]
                pipe = subprocess.PIPE
                server.append(subprocess.Popen(command, stdin=pipe, stdout=pipe, env=environment))
                server[0].stdout.readline()
            if not server:  # in a fork that came before the first reader
                return subprocess.run(words, input=input, timeout=timeout, **options)
            sys.audit("subprocess.Popen", words[0], words, None, None)  # `mutants.py` wants to know
            with tempfile.TemporaryDirectory(dir=folder) as place, socket.socket(socket.AF_UNIX) as connection:
                out = Path(place, "out")
                connection.connect(address)
                connection.settimeout(timeout)
                talk = connection.makefile("rw")
                print(json.dumps({"input": input, "out": str(out), "cwd": str(Path.cwd())}), file=talk, flush=True)
                child = int(talk.readline())
                try:
                    code = int(talk.readline())
                except TimeoutError:
                    os.kill(child, signal.SIGKILL)
                    raise subprocess.TimeoutExpired(words, timeout, out.read_bytes()) from None
                return subprocess.CompletedProcess(words, code, out.read_text("utf-8"))

        with patch.object(apart, "subprocess", SimpleNamespace(**{**vars(subprocess), "run": run})):
            yield
        for process in server:
            process.stdin.close()  # which ends it
            process.stdout.close()
            process.wait()


def serve(file: str, address: str) -> None:
    """Answer at a socket until stdin ends."""
    sys.path.insert(0, str(Path(file).parent))
    import reader  # type: ignore[import-not-found]
    from pxr import Ar, Sdf, Usd  # noqa: F401

    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # nobody waits for those who answer
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind(address)
        listening.listen(16)
        sys.stdout.write("ready\n")
        sys.stdout.flush()
        while sys.stdin not in select.select([listening, sys.stdin], [], [])[0]:
            connection, _ = listening.accept()
            if not os.fork():
                answer(connection, reader.main)
                os._exit(0)
            connection.close()


def answer(connection: socket.socket, main) -> None:
    """Fork a reader for what a connection asks, and tell its number and how it ended."""
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    talk = connection.makefile("rw")
    asked = json.loads(talk.readline())
    out = os.open(asked["out"], os.O_WRONLY | os.O_CREAT)
    child = os.fork()
    if not child:
        code = 1
        try:
            os.chdir(asked["cwd"])
            os.dup2(out, 1)
            os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
            sys.stdin = io.StringIO(asked["input"])
            main()
            sys.stdout.flush()
            code = 0
        finally:
            os._exit(code)
    print(child, file=talk, flush=True)
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), file=talk, flush=True)


if __name__ == "__main__":
    serve(*sys.argv[1:])
