"""A run on Ray in which a worker or a node is killed, and the same without; the rooms must be the same bytes.

    python tests/clients/ray_batch.py worker|node|limits [--rooms 8]

Runs in an environment that has Ray; prints `same N` at the end. Linux only: processes are found by a mark in /proc.
`limits` has tasks that stall and eat memory instead, on a cluster of its own.
"""

from __future__ import annotations

import argparse
import math
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
import uuid
from pathlib import Path

from echousd.batches.batch import BatchProgress, batch
from echousd.batches.executor import RayCluster, Task
from echousd.batches.plan import room_digest

MARK = "ECHOUSD_RAY_NODE"
QUICK = {"shapes": "boxes", "preview": False, "drafts": 1, "steps": 2}


def marked(word: str, title: bytes = b"") -> list[int]:
    """Processes whose environment carries our mark, and whose command line begins with a title."""
    found = []
    for place in Path("/proc").iterdir():
        try:
            ours = f"{MARK}={word}".encode() in (place / "environ").read_bytes().split(b"\0")
            if ours and (place / "cmdline").read_bytes().startswith(title):
                found.append(int(place.name))
        except (OSError, ValueError):
            continue
    return found


def kill(processes: list[int]) -> int:
    for process in processes:
        try:
            os.kill(process, signal.SIGKILL)
        except ProcessLookupError:
            continue
    return len(processes)


def node(word: str, scratch: Path, *arguments: str) -> None:
    """`ray start`, with the mark in the environment of all that it starts."""
    ray = Path(sys.executable).with_name("ray")
    command = [str(ray), "start", "--num-cpus=1", "--disable-usage-stats", *arguments]
    environment = {**os.environ, MARK: word, "OMP_NUM_THREADS": "1", "RAY_health_check_period_ms": "500"}
    subprocess.run(command, check=True, env=environment, stdout=subprocess.DEVNULL, cwd=scratch)


def eat(_: object) -> None:
    held = []
    while True:
        held.append(bytearray(20 * 2**20))
        time.sleep(0.01)


def limits() -> None:
    """What stalls or eats memory is given up with its cause, and the cluster goes on."""
    cluster = RayCluster(workers=2, timeout=15, memory=1000)
    tasks = [
        Task("stalls", time.sleep, 60),
        Task("eats", eat, None),
        *(Task(f"{k}", math.sqrt, k * k) for k in range(4)),
    ]
    waiting, found = list(tasks), {}
    try:
        while len(found) < len(tasks):
            while waiting and cluster.free():
                cluster.submit(waiting.pop(0))
            found |= {outcome.task.key: outcome for outcome in cluster.outcomes(1.0)}
    finally:
        cluster.close()
    assert [found[str(k)].value for k in range(4)] == [0, 1, 2, 3]
    assert (found["stalls"].fate, found["stalls"].error) == ("limit", "took longer than 15 s")
    assert found["eats"].fate == "limit"
    assert found["eats"].error.endswith("MiB of memory, allowed: 1000 MiB"), found["eats"]
    print("same 4")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("worker", "node", "limits"))
    parser.add_argument("--rooms", type=int, default=8)
    options = parser.parse_args()
    run = uuid.uuid4().hex[:8]
    os.environ |= {"RAY_AUTH_MODE": "token", "RAY_AUTH_TOKEN": uuid.uuid4().hex}  # of this cluster alone
    killed = [0]

    def strike(progress: BatchProgress) -> None:
        if progress.done >= 2 and not killed[0]:
            if options.what == "node":
                killed[0] = kill(marked(f"{run}_2"))
            else:
                killed[0] = kill(marked(f"{run}_1", b"ray::watched")[:1])
            print(f"after {progress.done} rooms: {killed[0]} processes killed", flush=True)

    if options.what == "limits":
        limits()
        return
    with tempfile.TemporaryDirectory(prefix="er") as name:
        top = Path(name)
        request = {"sample": {"bedroom": options.rooms}, **QUICK}
        began = time.monotonic()
        batch(out=top / "calm", workers=2, **request)
        print(f"processes here: {time.monotonic() - began:.0f} s", flush=True)
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        try:
            node(f"{run}_1", top, "--head", f"--port={port}", f"--temp-dir={top}/r", "--include-dashboard=false")
            node(f"{run}_2", top, f"--address=127.0.0.1:{port}")
            began = time.monotonic()
            made = batch(out=top / "wild", ray=f"127.0.0.1:{port}", progress=strike, **request)
            print(f"on Ray: {time.monotonic() - began:.0f} s, {made}", flush=True)
        finally:
            kill([*marked(f"{run}_1"), *marked(f"{run}_2")])
        rooms = sorted((top / "calm" / "rooms").glob("*/*"))
        same = sum(room_digest(room) == room_digest(top / "wild" / room.relative_to(top / "calm")) for room in rooms)
        if not killed[0] or made.done != options.rooms or same != options.rooms:
            raise SystemExit(f"{killed[0]} killed, {made.done} done, {same} of {options.rooms} the same bytes")
        print(f"same {same}")


if __name__ == "__main__":
    main()
