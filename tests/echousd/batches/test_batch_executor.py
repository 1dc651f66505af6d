"""Workers that die, stall, eat memory or raise cost their task and nothing else."""

import os
import subprocess
import sys
import time
from multiprocessing import active_children

import pytest
from bad_tasks import broken, dies, eats, square, stalls, wrong

from echousd.batches.executor import LocalWorkers, Task, attempt


def all_outcomes(pool, tasks):
    waiting, found = list(tasks), {}
    while len(found) < len(tasks):
        while waiting and pool.free():
            pool.submit(waiting.pop(0))
        for outcome in pool.outcomes(1.0):
            found[outcome.task.key] = outcome
    return found


@pytest.mark.skipif(sys.platform != "linux", reason="memory is measured in /proc")
def test_a_bad_task_costs_only_itself():
    pool = LocalWorkers(2, timeout=4.0, memory=300)
    calls = [("raises", wrong), ("breaks", broken), ("dies", dies), ("stalls", stalls), ("eats", eats)]
    tasks = [Task(f"square {k}", square, k) for k in range(6)]
    for place, (key, call) in enumerate(calls):
        tasks.insert(place, Task(key, call, None))
    try:
        found = all_outcomes(pool, tasks)
        assert [found[f"square {k}"].value for k in range(6)] == [0, 1, 4, 9, 16, 25]
        assert (found["raises"].fate, found["raises"].error) == ("error", "no such room")
        assert "unexpected KeyError" in found["breaks"].error
        assert (found["dies"].fate, found["dies"].error) == ("died", "the worker was killed (signal 9)")
        assert (found["stalls"].fate, found["stalls"].error) == ("limit", "took longer than 4 s")
        assert found["eats"].fate == "limit"
        assert found["eats"].error.endswith("MiB of memory, allowed: 300 MiB")
        assert pool.free() == 2
    finally:
        processes = [process.pid for process in active_children()]
        pool.close()
    assert not any(os.path.exists(f"/proc/{process}") for process in processes)  # noqa: PTH110


SCRIPT = """
from math import sqrt
from echousd.batches.executor import LocalWorkers, Task
pool = LocalWorkers(1)
pool.submit(Task("root", sqrt, 49))
print(pool.outcomes(60.0)[0])
pool.close()
"""


@pytest.mark.parametrize("place", ["-", "script.py"])
def test_a_script_without_a_guard_has_workers_wherever_it_comes_from(tmp_path, place):
    (tmp_path / "script.py").write_text(SCRIPT)
    done = subprocess.run(
        [sys.executable, place], input=SCRIPT, cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert "fate='done', value=7.0" in done.stdout
    assert done.stderr == ""


def test_what_a_task_raises_is_one_line():
    assert attempt(square, 3) == ("done", 9)
    assert attempt(wrong, None) == ("error", "no such room")


@pytest.mark.skipif(sys.platform != "linux", reason="workers end with their parent where the system offers it")
def test_workers_end_with_a_parent_that_is_killed(tmp_path):
    script = tmp_path / "parent.py"
    script.write_text(
        "import time\nfrom multiprocessing import active_children\n"
        "from echousd.batches.executor import LocalWorkers, Task\n"
        "if __name__ == '__main__':\n    pool = LocalWorkers(1)\n    pool.submit(Task('a', time.sleep, 60))\n"
        "    time.sleep(1)\n    print(active_children()[0].pid, flush=True)\n    time.sleep(60)\n"
    )
    parent = subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, text=True)
    worker = int(parent.stdout.readline())
    parent.kill()
    parent.wait()
    until = time.monotonic() + 5
    while os.path.exists(f"/proc/{worker}") and time.monotonic() < until:  # noqa: PTH110
        state = open(f"/proc/{worker}/stat").read().rsplit(")", 1)[1].split()[0]  # noqa: PTH123, SIM115
        if state == "Z":
            return
        time.sleep(0.1)
    assert not os.path.exists(f"/proc/{worker}")  # noqa: PTH110
