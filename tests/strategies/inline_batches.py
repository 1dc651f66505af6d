"""Batches in the test's own process, of rooms that are made fast."""

import json
from unittest.mock import patch

from small_room import BARE

from echousd.batches import batch as batches
from echousd.batches.executor import Outcome, attempt
from echousd.batches.plan import room_digest

QUICK = {"shapes": "boxes", "preview": False, "drafts": 1, "steps": 2, **BARE}


class Inline:
    """Runs tasks where it stands; `fates` are forced upon the first tries of some."""

    workers = 1

    def __init__(self, fates=()):
        self.fates, self.done, self.megabytes, self.calls = dict(fates), [], 0.0, []

    def free(self):
        return 1 - len(self.done)

    def submit(self, task):
        self.calls.append(task.key)
        forced = self.fates.get(task.key)
        if forced:
            fate = forced.pop(0)
            self.done.append(Outcome(task, fate, error=f"forced: {fate}"))
            return
        fate, value = attempt(task.call, task.argument)
        self.done.append(Outcome(task, fate, value) if fate == "done" else Outcome(task, fate, error=value))

    def outcomes(self, seconds):
        out, self.done = self.done, []
        return out

    def close(self):
        pass


def batch(*given, executor=None, **options):
    """`echousd.batch`, by an executor of one's own on whatever devices are asked for."""
    if executor is None:
        return batches.batch(*given, **options)
    with (
        patch.object(batches, "_executor", lambda how, rooms, device: executor),
        patch("echousd.batches.work.devices", lambda name: []),
    ):
        return batches.batch(*given, **options)


def digests(folder):
    return {path.name: room_digest(path) for path in sorted((folder / "rooms").glob("*/*"))}


def small(tmp_path):
    """Two graphs of two objects, one of them in JSON lines beside a poisonous one."""
    graph = {"room": {"type": "bedroom"}, "nodes": [], "relations": []}
    texts = []
    for things in (("double_bed", "wardrobe"), ("desk", "office_chair")):
        nodes = [{"name": thing, "category": thing} for thing in things]
        texts.append(json.dumps({**graph, "nodes": nodes}))
    path = tmp_path / "graphs.jsonl"
    path.write_text(f'{texts[0]}\n{{"room": "cellar"\n{texts[1]}\n')
    return path
