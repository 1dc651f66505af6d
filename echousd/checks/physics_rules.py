"""Rules on physics: no body inside another, colliders that engines take and that fit, gravity that points down."""

from collections.abc import Iterator

import numpy as np
from pxr import Sdf, Tf, Usd, UsdGeom, UsdPhysics

from echomodel.dressing import SMALL
from echomodel.vocabulary import vocabulary
from echousd.checks.reading import Finding, Reading, below, rule
from echousd.graph.nodes import OBSTACLE
from echousd.stage.contents import words_of
from echousd.stage.encoding import CATEGORY, FREE
from echousd.stage.read import value
from echousd.stage.units import up_axis, upwards
from echousd.stage.values import UNREADABLE, array, lineage, moves, readable, targets

HEAVY = 3000.0  # kg in each m³ of a body's box: stone
APART = 0.05  # metres between the anchors of a hinge, and from a centre of mass to the geometry
DOWN = 0.9  # cosine of the angle between gravity and downwards
SLACK = 1e-2  # relative error of what is stored in single precision and rounded
OFF = 0.25  # metres between the boxes of geometry and colliders, which are hulls or a few boxes

CONCAVE = (UsdPhysics.Tokens.none, UsdPhysics.Tokens.meshSimplification)


@rule("echo:NestedBodies", "prims", UsdPhysics.RigidBodyAPI)
def nested_bodies(_reading: Reading, prim: Usd.Prim) -> Iterator[str]:
    """No rigid body lies below another one, unless it resets the transform stack."""
    above = None if UsdGeom.Xformable(prim).GetResetXformStack() else _body_above(prim.GetParent())
    if above:
        yield f"a rigid body inside the rigid body <{above.GetPath()}>, allowed: side by side"


@rule("echo:DynamicColliders", "prims", UsdPhysics.CollisionAPI)
def dynamic_colliders(_reading: Reading, prim: Usd.Prim) -> Iterator[str]:
    """What moves collides with hulls or primitives: engines refuse triangle meshes on dynamic bodies."""
    body = _body_above(prim) if prim.IsA(UsdGeom.Mesh) else None
    if not body or not moves(body):
        return
    approximated = prim.HasAPI(UsdPhysics.MeshCollisionAPI)
    kind = UsdPhysics.MeshCollisionAPI(prim).GetApproximationAttr().Get() if approximated else UsdPhysics.Tokens.none
    if kind in CONCAVE:
        yield (
            f"physics:approximation is {kind!r} on a collider of the dynamic body <{body.GetPath()}>, "
            "allowed: convexHull, convexDecomposition, boundingCube, boundingSphere"
        )


@rule("echo:Colliders")
def colliders(reading: Reading) -> Iterator[Finding]:
    """Every rigid body has colliders, and they fill the same box as its geometry."""
    bodies = [prim for prim in reading.prims if prim.HasAPI(UsdPhysics.RigidBodyAPI)]
    for prim in bodies:
        shapes = [found for found in below(prim) if found.IsA(UsdGeom.Gprim)]
        solid = [found for found in shapes if _collides(found)]
        if shapes and not solid and not _collides(prim):
            yield Finding(prim.GetPath(), "a rigid body without colliders: it falls through the floor")
            continue
        seen = [found for found in shapes if not reading.is_guide(found)]
        try:
            boxes = [_bounds(gprims, reading) for gprims in (seen, solid)]
        except UNREADABLE:
            continue
        if boxes[0] is None or boxes[1] is None:
            continue
        apart = float(np.abs(boxes[0] - boxes[1]).max()) * reading.metres
        if apart > OFF:
            yield Finding(prim.GetPath(), f"its colliders end {apart:.2g} m from its geometry, allowed: {OFF:g} m")
    if bodies:
        yield from _bare_shell(reading)


def _bare_shell(reading: Reading) -> Iterator[Finding]:
    """Floors that bodies fall through, and walls that they pass."""
    for prim in reading.prims:
        words = words_of(prim)
        if not {"floor", "wall"} & set(words):
            continue
        shapes = [found for found in below(prim) if found.IsA(UsdGeom.Gprim)]
        if shapes and not any(map(_collides, (prim, *shapes))):
            what = "floor without colliders: bodies fall through" if "floor" in words else "wall without colliders"
            yield Finding(prim.GetPath(), f"a {what}", warning="floor" not in words)


def _collides(prim: Usd.Prim) -> bool:
    """Whether a prim is a collider that is switched on."""
    if not prim.HasAPI(UsdPhysics.CollisionAPI):
        return False
    try:
        return UsdPhysics.CollisionAPI(prim).GetCollisionEnabledAttr().Get() is not False
    except Tf.ErrorException:  # the rules on values report it
        return True


def _bounds(gprims: list[Usd.Prim], reading: Reading) -> np.ndarray | None:
    """(2, 3) float: box around some prims in the world, None for none."""
    boxes = [box for box in map(reading.box, gprims) if box is not None]
    return np.stack([np.min(boxes, (0, 1)), np.max(boxes, (0, 1))]) if boxes else None


@rule("echo:Gravity", "prims", UsdPhysics.Scene)
def gravity(reading: Reading, prim: Usd.Prim) -> Iterator[str]:
    """Gravity points down."""
    axis, up = up_axis(reading.stage), upwards(reading.stage)
    direction = array(prim.GetAttribute("physics:gravityDirection"))
    length = float(np.linalg.norm(direction))
    if direction.shape == (3,) and length > 0 and direction @ up > -DOWN * length:  # (0, 0, 0) = downwards
        shown = ", ".join(f"{value:g}" for value in direction)
        yield f"gravity points along ({shown}), allowed: downwards on a {axis}-up stage"


@rule("echo:Masses", "prims", UsdPhysics.MassAPI)
def masses(reading: Reading, prim: Usd.Prim) -> Iterator[str]:
    """A body weighs no more than stone, its centre is within its geometry, its inertia that of something."""
    if prim.IsInstanceProxy():
        return
    authored = UsdPhysics.MassAPI(prim)
    mass, centre = authored.GetMassAttr().Get(), authored.GetCenterOfMassAttr()
    shapes = [found for found in below(prim) if found.IsA(UsdGeom.Gprim) and not reading.is_guide(found)]
    box = _bounds(shapes, reading)
    world = reading.world(prim)
    if box is None:
        return
    box = box * reading.metres
    volume = float(np.prod(np.maximum(box[1] - box[0], 1e-3)))
    most = HEAVY * volume + 1
    if isinstance(mass, float) and mass > most:
        yield f"physics:mass is {mass:g} kg in a box of {volume:.3g} m³, allowed: {most:.3g}"
    local = array(centre) if centre.HasAuthoredValue() else np.zeros(0)
    if local.shape == (3,) and np.isfinite(local).all():
        at = (world[:3, :3] @ local + world[:3, 3]) * reading.metres
        off = float(np.maximum(box[0] - at, at - box[1]).max())
        if off > APART:
            yield f"its centre of mass lies {off:.2g} m outside its geometry"
    yield from _inertia(authored)


def _inertia(authored: UsdPhysics.MassAPI) -> Iterator[str]:
    inertia, axes = authored.GetDiagonalInertiaAttr().Get(), authored.GetPrincipalAxesAttr()
    if inertia is not None and 2 * max(inertia) > sum(inertia) * (1 + SLACK):
        shown = ", ".join(f"{value:g}" for value in inertia)
        yield f"physics:diagonalInertia is {shown}, allowed: none larger than both others"
    turn = axes.Get() if axes.HasAuthoredValue() else None
    length = 0.0 if turn is None else turn.GetLength()
    if length > 0 and abs(length - 1) > SLACK:  # (0, 0, 0, 0) = as the engine finds
        yield f"physics:principalAxes has length {length:.3g}, allowed: 1"


@rule("echo:FixedFurniture")
def fixed_furniture(reading: Reading) -> Iterator[Finding]:
    """Where most pieces of a room are bodies, all that stand on a floor or a table are, and can move."""
    for room in reading.rooms:
        nodes = {prim: _stands(prim) for prim in room.nodes}
        bodies = {prim: [found for found in below(prim) if found.HasAPI(UsdPhysics.RigidBodyAPI)] for prim in nodes}
        standing = [prim for prim, stands in nodes.items() if stands]
        moving = [prim for prim in standing if any(map(moves, bodies[prim]))]
        for prim in standing if 2 * len(moving) > len(standing) else ():
            if prim not in moving:
                what = "a rigid body that cannot move" if bodies[prim] else "no rigid body"
                yield Finding(prim.GetPath(), f"{what}, but the furniture of its room is such")


def _stands(prim: Usd.Prim) -> bool:
    """Whether a node is furniture that stands somewhere, rather than hangs, is fixed or an obstacle."""
    word = readable(lambda: value(prim, CATEGORY), None)
    row = vocabulary().known_category(word) if isinstance(word, str) else None
    fixed = row is None or (row.name in SMALL and SMALL[row.name].fixed) or row.support not in ("floor", "table")
    return not fixed and not value(prim, f"{FREE}{OBSTACLE}")


@rule("echo:PhysicsScene")
def scenes(reading: Reading) -> Iterator[Finding]:
    """What has bodies has a physics scene that nobody switched off."""
    off = [prim for prim in reading.inactive if prim.GetTypeName() == "PhysicsScene"]
    if off and not any(prim.GetTypeName() == "PhysicsScene" for prim in reading.prims):
        yield Finding(off[0].GetPath(), "the physics scene is deactivated: engines take gravity of their own, or none")


@rule("echo:Joints", "prims", UsdPhysics.Joint)
def joints(reading: Reading, prim: Usd.Prim) -> Iterator[str]:
    """A joint holds two different prims that are there, at one place, and its limits leave it room."""
    ends = [targets(prim, f"physics:body{number}") for number in (0, 1)]
    for number, found in enumerate(ends):
        for path in found:
            if not reading.stage.GetPrimAtPath(path):
                yield f"physics:body{number} points to <{path}>, where no prim is"
    if not any(ends):
        yield "a joint that holds nothing, allowed: physics:body0 or physics:body1"
    elif ends[0] == ends[1]:
        yield f"holds <{ends[0][0]}> to itself, allowed: two different prims"
    low, high = (prim.GetAttribute(f"physics:{word}Limit").Get() for word in ("lower", "upper"))
    if low is not None and high is not None and low > high:
        yield f"its limits are {low:g} to {high:g}, allowed: from the lower to the upper"
    if all(ends) and ends[0] != ends[1]:
        apart = _anchors_apart(prim, ends, reading)
        if apart is not None and apart > APART:
            yield f"its anchors are {apart:.2g} m apart, allowed: {APART:g} m"


def _anchors_apart(joint: Usd.Prim, ends: list[list[Sdf.Path]], reading: Reading) -> float | None:
    """Metres between a hinge's place on its two bodies, None for other joints (drawers stand open)."""
    bodies = [reading.stage.GetPrimAtPath(found[0]) for found in ends]
    if joint.GetTypeName() not in ("PhysicsRevoluteJoint", "PhysicsSphericalJoint") or not all(bodies):
        return None
    places = []
    for number, body in enumerate(bodies):
        local = joint.GetAttribute(f"physics:localPos{number}").Get()
        world = reading.world(body)
        places.append(world[:3, :3] @ np.array(local if local is not None else (0, 0, 0), float) + world[:3, 3])
    return float(np.linalg.norm(places[0] - places[1])) * reading.metres


def _body_above(prim: Usd.Prim) -> Usd.Prim | None:
    return next((above for above in lineage(prim) if above.HasAPI(UsdPhysics.RigidBodyAPI)), None)
