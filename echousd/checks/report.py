"""Check a room: relations, collisions, placement, living rules and USD validity in one report."""

from __future__ import annotations

import importlib
import os
import warnings
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pxr import Plug, Sdf, Tf, Usd, UsdUtils

import echousd
from echousd.checks.placement import Misplacement, Whole, find_collisions, find_misplaced
from echousd.checks.reading import RULES, Finding, Reading, StageRule
from echousd.draw.sight import Furniture
from echousd.folder.journal import digest_of
from echousd.folder.manifest import find_manifest
from echousd.graph import RoomSpec, SceneGraph
from echousd.graph.consistency import GraphError
from echousd.graph.floors import check_extents
from echousd.place.geometry import Collision
from echousd.place.living import LivingFault, living_faults
from echousd.room import Verdict
from echousd.stage.contents import RoomContents
from echousd.stage.encoding import StageError
from echousd.stage.files import opened, source, usd_error
from echousd.stage.foreign import UNTOLD
from echousd.stage.pen import ARTICULATED, ARTICULATION
from echousd.stage.showing import each_layout, showing_variant
from echousd.stage.values import UNREADABLE, readable

if TYPE_CHECKING:
    from echousd.settle.settle import SettleReport


FAMILIES = ("object", "look", "mesh", "physics", "file")
for family in FAMILIES:
    importlib.import_module(f"echousd.checks.{family}_rules")  # its rules enter the table
JOINED = tuple(rule for rule in RULES if rule.name in ("echo:Joints", "echo:PhysicsValues"))
ALONE = "echo:Validators"
PACKED, OF_PACKAGES = ".usdz", "usdUtilsValidators:UsdzPackageValidator"  # which looks through all layers to find none
UNKNOWN_NODE, MATERIALX = ".MissingShaderIdInRegistry", "shaderId 'ND_"


@dataclass(frozen=True, order=True)
class Fault:
    """A fault of the stage: which rule found it, at which prim, and what it says."""

    rule: str
    prim: str
    message: str


def safely(rule: StageRule, reading: Reading) -> list[Finding]:
    """What a rule finds; a stage that it cannot read through is a finding as well."""
    found: list[Finding] = []
    try:
        found.extend(rule.find(reading))
    except UNREADABLE as error:
        why = f"cannot be read through: {usd_error(error)}" if isinstance(error, Tf.ErrorException) else str(error)
        found.append(Finding(Sdf.Path.absoluteRootPath, why))
    return found


def find_faults(reading: Reading) -> tuple[tuple[Fault, ...], tuple[Fault, ...]]:
    """Errors and warnings of all validators, in a stable order; ours share what they read of the stage.

    An OpenUSD without UsdValidation runs our rules alone and says so in a warning.
    """
    assert echousd.__version__  # importing the package registers the schema plugin
    stage = reading.stage
    with ThreadPoolExecutor(1) as beside:  # OpenUSD lets go of Python's lock
        theirs = beside.submit(_faults_of_usd, reading)
        own = [(rule, found) for rule in RULES for found in safely(rule, reading)]
    with showing_variant(stage, ARTICULATION, ARTICULATED) as changed:  # doors and drawers are joined in it alone
        joined = Reading(stage)
        own += [(rule, found) for rule in JOINED if changed for found in safely(rule, joined)]
    errors, warnings = theirs.result()
    for rule, found in own:
        (warnings if found.warning else errors).add(Fault(rule.name, str(found.path), found.message))
    return tuple(sorted(errors)), tuple(sorted(warnings))


def _faults_of_usd(reading: Reading) -> tuple[set[Fault], set[Fault]]:
    """Errors and warnings of OpenUSD's own validators."""
    try:
        from pxr import UsdValidation

        known = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    except (ImportError, AttributeError, TypeError):
        version = ".".join(map(str, Usd.GetVersion()))
        alone = f"OpenUSD {version} has no UsdValidation for Python: only our own rules ran"
        return set(), {Fault(ALONE, "/", alone)}
    files = (path for layer, paths in reading.named_files.items() for path in (layer.identifier, *paths))
    if readable(lambda: not any(PACKED in path for path in files), False):
        known = [one for one in known if one.GetMetadata().name != OF_PACKAGES]
    context = UsdValidation.ValidationContext(known)
    silence = UsdUtils.CoalescingDiagnosticDelegate()  # USD would print what the report says as well
    try:
        found_errors = context.Validate(reading.stage)
    except Tf.ErrorException as stopped:  # a validator that cannot read the stage ends the whole run
        return {Fault(ALONE, "/", f"OpenUSD's validators stopped: {usd_error(stopped)}")}, set()
    finally:
        silence.TakeUncoalescedDiagnostics()
        del silence
    errors, warnings = set(), set()
    knows_materialx = bool(Plug.Registry().GetPluginWithName("usdMtlx"))  # usd-core comes without it
    for error in found_errors:
        name = f"{error.GetValidator().GetMetadata().name}.{error.GetName()}"
        fault = Fault(name, _site(error), " ".join(error.GetMessage().split()))
        if not knows_materialx and fault.rule.endswith(UNKNOWN_NODE) and MATERIALX in fault.message:
            continue
        if error.GetType() == UsdValidation.ValidationErrorType.Error:
            errors.add(fault)
        elif error.GetType() == UsdValidation.ValidationErrorType.Warn:
            warnings.add(fault)
    return errors, warnings


def _site(error: Any) -> str:
    for site in error.GetSites():
        if site.IsPrim():
            return str(site.GetPrim().GetPath())
        if site.IsProperty():
            return str(site.GetProperty().GetPath())
        if site.GetLayer():
            return str(site.GetLayer().GetDisplayName())
    return str(Sdf.Path.absoluteRootPath)


def verdicts_of(room: RoomContents, rules: str = "strict") -> tuple[Verdict, ...]:
    """What became of every relation, and of placements of objects with boxes; raises ValueError for unknown rules."""
    from echousd.make.verdicts import relation_verdicts

    here = {thing.name for thing in room.objects}
    nodes = [
        thing.node if {*(thing.node.between or ())} <= here else thing.node.model_copy(update={"between": None})
        for thing in room.objects
    ]
    spec = room.spec or RoomSpec(UNTOLD)  # what contradicts itself in it is told by others
    graph = SceneGraph.model_construct(room=spec, nodes=tuple(nodes), relations=room.relations)
    unmeasured = (Verdict(*relation.triple, "unmeasured") for relation in room.unmeasured)
    return (*relation_verdicts(graph, _boxes(room), rules=rules), *unmeasured)


@dataclass(frozen=True)
class LayoutReport:
    """What a check found in one layout.

    Arguments:
        name: of the variant, "" where the room has only one layout.
        relations: every relation, and placements of objects with boxes, with verdict and margin.
        collisions, placement: what stands where it should not.
        living: what a person would point at though the graph does not forbid it; warnings.
    """

    name: str
    relations: tuple[Verdict, ...]
    collisions: tuple[Collision, ...]
    placement: tuple[Misplacement, ...]
    living: tuple[LivingFault, ...]

    @property
    def broken(self) -> tuple[Verdict, ...]:
        """The relations that do not hold."""
        return tuple(relation for relation in self.relations if relation.state == "broken")

    @property
    def kept(self) -> int:
        """Number of measured relations that hold."""
        return sum(relation.state == "kept" for relation in self.relations)

    @property
    def ok(self) -> bool:
        """Nothing is broken, collides or stands in the wrong place."""
        return not (self.broken or self.collisions or self.placement)

    def to_json(self) -> dict[str, Any]:
        """The entry of the report."""
        return {
            "relations": {
                "kept": self.kept,
                "broken": [relation.to_json() for relation in self.broken],
                "unmeasured": sum(relation.state == "unmeasured" for relation in self.relations),
            },
            "collisions": [hit.to_json() for hit in self.collisions],
            "placement": [wrong.to_json() for wrong in self.placement],
            "living": [fault.to_json() for fault in self.living],
        }


def _of_layouts(name: str, says: str) -> Any:
    """What is found in any layout under a name of `LayoutReport`."""
    return property(lambda report: tuple(one for each in report.layouts for one in getattr(each, name)), doc=says)


@dataclass(frozen=True)
class CheckReport:
    """What a check found.

    Arguments:
        source: the file (or layer) that was checked; rooms: prim paths of its rooms.
        layouts: what was found in each layout, the only one of most rooms called "".
        errors, warnings: of the USD validators, ours included.
        settled: how every layout behaved under gravity, None where nobody asked.
    """

    source: str
    rooms: tuple[str, ...]
    layouts: tuple[LayoutReport, ...]
    errors: tuple[Fault, ...]
    warnings: tuple[Fault, ...]
    settled: tuple[SettleReport, ...] | None = None

    relations = _of_layouts("relations", "The relations of all layouts.")
    collisions = _of_layouts("collisions", "The collisions of all layouts.")
    placement = _of_layouts("placement", "What is misplaced in any layout.")
    living = _of_layouts("living", "What a person would point at in any layout.")
    broken = _of_layouts("broken", "The relations that do not hold, of all layouts.")

    @property
    def ok(self) -> bool:
        """Nothing but warnings was found, and all that was simulated rests."""
        rests = all(found.ok for found in self.settled or ())
        return not self.errors and rests and all(layout.ok for layout in self.layouts)

    def good(self, *, strict: bool = False) -> bool:
        """Whether the check is passed; broken living rules fail a strict one."""
        return self.ok and not (strict and self.living)

    def to_json(self) -> dict[str, Any]:
        """The report as `echousd check --json` prints it; of several layouts, each has its entry."""
        several = len(self.layouts) > 1 or any(layout.name for layout in self.layouts)
        each = {layout.name: {"ok": layout.ok, **layout.to_json()} for layout in self.layouts}
        found = {"layouts": each} if several else self.layouts[0].to_json()
        rest = {} if self.settled is None else {"settle": [each.to_json() for each in self.settled]}
        usd = {"errors": self.errors, "warnings": self.warnings}
        of_usd = {word: [asdict(fault) for fault in faults] for word, faults in usd.items()}
        return {"ok": self.ok, **found, "usd": of_usd, **rest}


def check(
    stage: Usd.Stage | str | os.PathLike[str], *, rules: str = "strict", layout: int | None = None,
    settle: bool = False,
) -> CheckReport:  # fmt: skip
    """Check every room on a stage, in all of its layouts.

    Arguments:
        stage: an open stage, a file or a room's folder.
        rules: `strict` or `sgfront`, for the relations.
        layout: number of the only layout to check.
        settle: simulate two seconds of every layout as well, in which everything must rest.

    Raises:
        ValueError: the file cannot be opened, holds no room or no such layout, or the rules are unknown.
        SettleUnavailable: `settle` without the extra `sim`.
    """
    from echomodel.rules import rule_set

    rule_set(rules)
    reading = Reading(stage := opened(stage))
    errors, warnings = find_faults(reading)
    found = [check_layout(Reading(stage) if name else reading, name, rules) for name in each_layout(stage, layout)]
    rooms = found[0][0]
    if not rooms and not errors:
        raise StageError(
            f"{source(stage)}: no room (no EchoSceneGraph prim), nothing to check; echousd adopt makes one"
        )
    first = found[0][1]
    if len(rooms) == 1 and first.name in ("", "layout_0"):
        errors = (*errors, *rewritten(stage, rooms[0], first.relations))
    settled = None
    if settle:
        from echousd.settle.settle import settle_layouts

        settled = settle_layouts(stage, layout=layout)
    return CheckReport(source(stage), rooms, tuple(report for _, report in found), errors, warnings, settled)


def check_layout(reading: Reading, name: str, rules: str) -> tuple[tuple[str, ...], LayoutReport]:
    """Prim paths of the rooms, and what is wrong with them as a stage shows them, in the layout of that name."""
    rooms = [Whole.of(prims, reading) for prims in reading.rooms]
    report = LayoutReport(
        name,
        tuple(relation for whole in rooms for relation in verdicts_of(whole.room, rules)),
        tuple(hit for whole in rooms for hit in find_collisions(whole)),
        tuple(wrong for whole in rooms for wrong in find_misplaced(whole)),
        tuple(fault for whole in rooms for fault in find_living(whole.room)),
    )
    return tuple(whole.room.path for whole in rooms), report


def _boxes(room: RoomContents) -> Furniture:
    rows = np.array([(*thing.size, *thing.position, thing.yaw) for thing in room.objects], float).reshape(-1, 7)
    return Furniture(rows[:, :3], rows[:, 3:6], rows[:, 6])


def find_living(room: RoomContents) -> tuple[LivingFault, ...]:
    """Every living rule that an object breaks; none in a room whose graph contradicts itself, which others report."""
    if not room.objects or room.spec is None:
        return ()
    try:
        check_extents(room.spec.extents)
    except GraphError as error:
        warnings.warn(f"<{room.path}>: {error}; nobody's ways are looked for on it", stacklevel=2)
        return ()
    try:
        graph = SceneGraph(room.spec, tuple(thing.node for thing in room.objects), room.relations)
    except GraphError:
        return ()
    return living_faults(graph, _boxes(room))


RULE = "echo:Manifest"
CLEAR = 0.02  # metres or ratio: verdicts of smaller margins may differ between boxes and meshes


def rewritten(stage: Usd.Stage, room: str, relations: Sequence[Verdict]) -> Iterator[Fault]:
    """Where a manifest says other than what is measured, of a room whose layers are those that it was written with.

    `room`: prim path. `relations`: of the first layout.
    """
    root = Path(stage.GetRootLayer().realPath)
    if not root.is_file() or not root.with_suffix(".json").is_file():
        return
    try:
        manifest = find_manifest(root.parent, root.stem)
    except ValueError as error:
        yield Fault(RULE, room, str(error))
        return
    files = {} if manifest is None else manifest["files"]
    layers = [name for name in files if name == root.name or name.startswith("layers/")]
    if manifest is None or manifest["name"] != root.stem or any(digest_of(root.parent / n) != files[n] for n in layers):
        return
    measured = {(one.subject, one.predicate, one.object): one for one in relations}
    written: dict[tuple[str, str, str], str] = {}
    verdicts = manifest["verdicts"] if isinstance(manifest.get("verdicts"), list) else []
    for verdict in (each for each in verdicts if isinstance(each, dict)):
        triple = (str(verdict.get("subject")), str(verdict.get("predicate")), str(verdict.get("object")))
        written[triple] = str(verdict.get("state"))
        found = measured.get(triple)
        if found is None or found.margin is None or abs(found.margin) < CLEAR:
            continue
        if (found.state == "kept") != (written[triple] == "kept"):
            message = f"'{found.sentence}' is {written[triple]}, it is {found.state} ({found.margin:+.3f})"
            yield Fault(RULE, room, f"{root.stem}.json says that {message}")
    for triple, found in measured.items():
        if found.margin is not None and triple not in written:
            yield Fault(RULE, room, f"{root.stem}.json says nothing of '{found.sentence}'")
    kept, counts = list(written.values()).count("kept"), manifest.get("relations")
    if not isinstance(counts, dict) or counts.get("kept") != kept:
        yield Fault(RULE, room, f"{root.stem}.json counts {counts} relations, its verdicts say {kept} kept")
