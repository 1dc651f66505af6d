"""Any sequence of steps: no byte that a person wrote is changed or lost, and every announced state can be had again.

`ECHOUSD_SEQUENCES` says how many sequences are drawn; the gate draws few.
"""

import json
import os
import re
import shutil
import tempfile
import warnings
from pathlib import Path

from dying_process import dying
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule
from plain_rooms import CATEGORIES, plain_files, plain_room
from pxr import Sdf

from echomodel.files import digest
from echousd.folder import folder as folders
from echousd.folder import history
from echousd.folder.lock import LOCK
from echousd.folder.manifest import find_manifest
from echousd.pending import STAGING, check_written, half_written
from echousd.store import Store

SEQUENCES, STEPS = int(os.environ.get("ECHOUSD_SEQUENCES", "40")), 8
TOUCHED = re.compile(r"^(.*?): (?:was changed since|is not the room's); move it away first")
OWN = (
    "notes.txt",
    "layers/mine.usda",
    "layers/unfit.usda",
    "textures/mine.jpg",
    *(f"{folder}/{number}.zip" for folder in ("history", ".redo") for number in (1, 2)),
    *(f"assets/{name}/{name}{end}" for name in CATEGORIES for end in (".usda", "_geo.usdc")),
)
OURS = ("bedroom.usda", "layers/layout.usda", "layers/graph.usda", "assets/bed/bed.usda", "assets/lamp/lamp.usda")
NAMES = st.sets(st.sampled_from(sorted(CATEGORIES)), min_size=1).map(sorted)
KILL = st.none() | st.integers(0, 70)
AGAIN = st.booleans()  # after a death: the same once more, or whatever comes next finishes it


class Sequences(RuleBasedStateMachine):
    """One room, its person and its store.

    `mine` are the bytes that the person has written and not taken away; `back` and `ahead` the states that undo and
    redo announce, path -> bytes, without what the person has touched since.
    """

    @initialize(names=NAMES, store=st.booleans())
    def begins(self, names, store):
        self.top = Path(tempfile.mkdtemp())
        self.folder = self.top / "bedroom"
        self.root = self.folder / "bedroom.usda"
        self.store = self.top / "store" if store else ""
        self.mine: set[bytes] = set()
        self.moved: set[str] = set()  # paths of the room's files that the person has taken away
        self.toys: dict[str, tuple[bytes, bool]] = {}  # prim in the root -> what was written, in a finished room
        self.back: list[dict[str, bytes]] = []
        self.ahead: list[dict[str, bytes]] = []
        self.count = 0
        self.patched = plain_files()
        self.patched.__enter__()
        self.listening = warnings.catch_warnings(record=True)
        self.told = self.listening.__enter__()
        warnings.simplefilter("always")
        plain_room(names, 0).save(self.folder, preview=False, store=self.store)
        self.now, self.step = self.state(), False

    def teardown(self):
        if not hasattr(self, "top"):
            return
        try:
            self.all_states_can_be_had_again()
        finally:
            self.listening.__exit__(None, None, None)
            self.patched.__exit__(None, None, None)
            shutil.rmtree(self.top)

    # ---- what the person does

    @rule(path=st.sampled_from(OWN))
    def puts_a_file(self, path):
        place = self.folder / path
        if not os.path.lexists(place):
            self.writes(path, b"#usda 1.0\n# mine %d\n" % self.number())

    @rule(path=st.sampled_from(OURS))
    def edits_a_file_of_the_room(self, path):
        if (self.folder / path).is_file():
            before = (self.folder / path).read_bytes()
            self.mine.discard(before)
            name = f"Toy{self.number()}" if path == self.root.name else ""
            after = before + (f'def Cube "{name}" {{}}\n' if name else "").encode() + b"# mine %d\n" % self.number()
            if name:
                self.toys[name] = after, not self.folder_pending()
            self.writes(path, after)

    @rule(asset=st.sampled_from(sorted(CATEGORIES)))
    def puts_a_layer_that_needs_an_asset(self, asset):
        number = self.number()
        if (self.folder / f"assets/{asset}/{asset}.usda").is_file():
            text = f'#usda 1.0\ndef "A{number}" (references = @./assets/{asset}/{asset}.usda@) {{}}\n'
            self.writes(f"shot_{number}.usda", text.encode())

    # ---- what we do

    @rule(names=NAMES, seed=st.integers(0, 2), kill=KILL, again=AGAIN)
    def generates(self, names, seed, kill, again):
        self.runs(lambda: plain_room(names, seed).save(self.folder, preview=False), kill, again)

    @rule(names=NAMES, kill=KILL, again=AGAIN)
    def edits(self, names, kill, again):
        self.follows()
        folders.recover(self.folder)
        made = plain_room(names, 0, self.root)
        self.runs(lambda: made.save(self.folder, preview=False), kill, again)

    @rule(kill=KILL, again=AGAIN)
    def undoes(self, kill, again):
        self.runs(lambda: self.steps(history.undo), kill, again, step=True)

    @rule(kill=KILL, again=AGAIN)
    def redoes(self, kill, again):
        self.runs(lambda: self.steps(history.redo), kill, again, step=True)

    @precondition(lambda self: self.store)
    @rule(kill=KILL)
    def collects(self, kill):
        with dying(kill):
            Store.open(self.store).collect([self.top], grace=0)

    # ---- what must hold

    @invariant()
    def nothing_of_the_person_is_lost(self):
        if not hasattr(self, "top"):
            return
        there = {path.read_bytes() for path in self.top.rglob("*") if path.is_file()}
        assert self.mine <= there, self.mine - there

    @invariant()
    def what_can_be_read_is_a_whole_room(self):
        if not hasattr(self, "top") or self.folder_pending():
            return
        check_written([self.root])
        manifest = find_manifest(self.folder, "bedroom")
        for path, recorded in manifest["files"].items():
            content = self.content(path)
            assert content is not None or path in self.moved, path
            ours = content is None or path == self.root.name or digest(content) == recorded
            assert ours or content in self.mine, path
        kept = {path.relative_to(self.folder).as_posix(): path.read_bytes() for path in self.folder.rglob("*.edited*")}
        said = [str(each.message) for each in self.told if str(each.message).startswith(str(self.folder))]
        assert all(any(line.endswith(f"; kept as {path}") for line in said) for path in kept), (kept, said)
        root = Sdf.Layer.OpenAsAnonymous(str(self.root))
        there = {prim.name for prim in root.rootPrims}
        for toy, (content, finished) in self.toys.items():
            # what is put into a run that has not ended is no part of the room that it makes, and kept beside it
            assert toy in there or (not finished and content in kept.values()), toy
        if manifest["store"]:
            store = Store.open(self.folder / manifest["store"])
            assert all(store.whole(key) for key in manifest["stored"].values())
        if not (self.folder / STAGING).exists():
            assert not [path for path in self.top.rglob("*.partial")]

    def all_states_can_be_had_again(self):
        """All the way back, all the way ahead."""
        self.follows()
        folders.recover(self.folder)
        for _ in range(len(self.back)):
            self.runs(lambda: self.steps(history.undo), None, True, step=True)
        assert self.back == []
        for _ in range(len(self.ahead)):
            self.runs(lambda: self.steps(history.redo), None, True, step=True)
        assert self.ahead == []
        self.nothing_of_the_person_is_lost()

    # ---- how

    def number(self):
        self.count += 1
        return self.count

    def writes(self, path, content):
        (self.folder / path).parent.mkdir(parents=True, exist_ok=True)
        (self.folder / path).write_bytes(content)
        self.mine.add(content)
        self.touches(path)

    def touches(self, path):
        for state in (*self.back, *self.ahead, self.now):
            state.pop(path, None)
        if not self.folder_pending():
            self.now = self.state()

    def content(self, path, folder=None):
        place = (folder or self.folder) / path
        return place.read_bytes() if place.is_file() else None

    def state(self, folder=None):
        paths = (*find_manifest(folder or self.folder, "bedroom")["files"], "bedroom.json")
        return {path: content for path in paths if (content := self.content(path, folder)) is not None}

    def folder_pending(self):
        return half_written(self.folder)

    def steps(self, step):
        """A step, before which the person moves away what is named to be in its way."""
        for _ in range(30):
            try:
                return step(self.root)
            except ValueError as error:
                if str(error).endswith(("no edit to take back", "can be made again")):
                    assert not (self.back if step is history.undo else self.ahead)
                    return ()
                if step is history.redo and not self.ahead and ".zip: cannot be read (" in str(error):
                    return ()  # the person's archive might have been one of an edit
                named = TOUCHED.match(str(error))
                if not named:
                    raise
                place = Path(named[1])
                (self.top / "moved").mkdir(exist_ok=True)
                place.rename(self.top / "moved" / str(self.number()))
                path = place.relative_to(self.folder).as_posix()
                self.moved.add(path)
                for state in (*self.back, *self.ahead, self.now):
                    state.pop(path, None)
                if path == self.root.name:
                    self.toys.clear()
        raise AssertionError("always another file is in the way")

    def runs(self, act, kill, again, step=False):
        self.follows()
        self.step = step
        with dying(kill) as state:
            act()
        if state.died and again:
            self.follows()
            act()
        if not state.died or again:
            assert not (self.folder / STAGING).exists()
            assert not (self.folder / LOCK).exists()
        self.follows()

    def follows(self):
        """What was announced, as the room says now, or will say once the run that has not ended is finished."""
        if not self.folder_pending():
            return self.announced(self.state(), self.folder)
        with tempfile.TemporaryDirectory() as place:
            copy = Path(shutil.copytree(self.folder, Path(place) / "bedroom", symlinks=True))
            folders.recover(copy)
            self.announced(self.state(copy), copy)

    def announced(self, now, folder):
        if now.get("bedroom.json") == self.now.get("bedroom.json"):
            theirs = {path for path, content in self.now.items() if content in self.mine or path == self.root.name}
            self.same(now, {path: content for path, content in self.now.items() if path not in theirs})
            if not self.step and now != self.now:  # the root alone was written anew: what was taken back is gone
                self.ahead = []
                assert history.undone(folder) == []
            self.now = now
            return
        length = len(json.loads(now["bedroom.json"])["history"])
        if (
            self.step
            and self.ahead
            and now["bedroom.json"] == self.ahead[-1]["bedroom.json"]
            and length == len(self.back) + 1
        ):
            self.back.append(self.now)
            self.same(now, self.ahead.pop())
        elif self.step and self.back and now["bedroom.json"] == self.back[-1]["bedroom.json"]:
            self.ahead.append(self.now)
            self.same(now, self.back.pop())
        elif length == 0:
            self.back, self.ahead = [], []
        else:
            assert not self.step
            assert length == len(self.back) + 1
            assert history.undone(folder) == []
            self.back, self.ahead = [*self.back, self.now], []
        self.now = now

    def same(self, found, announced):
        wrong = [path for path, content in announced.items() if found.get(path) != content]
        assert wrong == []


Sequences.TestCase.settings = settings(
    max_examples=SEQUENCES, stateful_step_count=STEPS, deadline=None, suppress_health_check=list(HealthCheck),
)  # fmt: skip
TestSequences = Sequences.TestCase
