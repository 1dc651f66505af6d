"""The kinds of files that a room can be written as, a row each; all that a stage composes to in one layer."""

import tempfile
import zipfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from pxr import Gf, Sdf, Tf, Usd, UsdGeom, UsdLux, UsdPhysics, UsdShade, UsdUtils

from echomodel.files import check_free, check_ours
from echousd.draw.drawables import rgb
from echousd.exporting.glb import glb
from echousd.exporting.habitat import habitat_files, sceneeval_files
from echousd.exporting.packing import Package, Reach, check_types, images_beside, take_assets, without_clock
from echousd.stage.encoding import BETWEEN, OBJECT, SUBJECT
from echousd.stage.files import layer_bytes, open_stage, prim_specs, source, write_all
from echousd.stage.showing import selected_layout, showing_layout
from echousd.stage.units import set_units
from echousd.stage.values import reading, targets
from echousd.textures import file_of


@dataclass(frozen=True)
class Export:
    """What is to be written: see `export`, whose arguments these are."""

    out: Path
    reach: Reach
    physics: bool
    pictures: bool
    arkit: bool


@dataclass(frozen=True)
class Format:
    """A kind of file, or of a folder that others read.

    Arguments:
        write: a stage and what is asked for -> path and content of every file, first the one that is opened.
        options: of `export`, those that it knows.
        physics: whether it holds physics unless it is told.
    """

    write: Callable[[Usd.Stage, Export], Mapping[Path, bytes]]
    options: frozenset[str] = frozenset()
    physics: bool = False


def _usdz(stage: Usd.Stage, asked: Export) -> Mapping[Path, bytes]:
    package = Package(asked.reach)
    return {asked.out: usdz(_flattened(stage, asked, package), package, arkit=asked.arkit)}


def _flat(stage: Usd.Stage, asked: Export) -> Mapping[Path, bytes]:
    package = Package(asked.reach, images_beside(asked.out))
    layer = _flattened(stage, asked, package)
    return {asked.out: layer_bytes(layer, asked.out.suffix), **package.files(asked.out.parent)}


def _flattened(stage: Usd.Stage, asked: Export, package: Package) -> Sdf.Layer:
    """The flat layer that is asked for, which says the stage's layout that it holds where there are several."""
    layer = flat_layer(stage, package=package if asked.pictures else None, physics=asked.physics)
    if layout := selected_layout(stage):
        layer.customLayerData = {**layer.customLayerData, "layout": layout}
    return layer


FORMATS: Mapping[str, Format] = {
    ".usdz": Format(_usdz, frozenset({"physics", "pictures", "arkit"})),
    ".glb": Format(lambda stage, asked: {asked.out: glb(stage, asked.reach)}),
    ".usda": Format(_flat, frozenset({"physics", "pictures"}), physics=True),
    ".usdc": Format(_flat, frozenset({"physics", "pictures"}), physics=True),
    "habitat": Format(lambda stage, asked: habitat_files(stage, asked.out, asked.reach)),
    "sceneeval": Format(lambda stage, asked: sceneeval_files(stage, asked.out)),
}
ENDINGS = tuple(word for word in FORMATS if word.startswith("."))
READERS = tuple(word for word in FORMATS if word not in ENDINGS)


def export(
    room: str | Path, out: str | Path, *, reader: str | None = None, arkit: bool = False, force: bool = False,
    search: Sequence[str | Path] = (), layout: int | None = None, physics: bool | None = None, pictures: bool = True,
) -> Path:  # fmt: skip
    """Write a room (any stage) as one file, or as the folder that one `reader` expects, and return what to open.

    Arguments:
        room: root layer or folder of the room.
        out: `.usdz` (one flat usda inside, which web viewers read), `.glb`, or a flat `.usda` or `.usdc`; or a folder.
        reader: `sceneeval` (its sceneState, a glb for every object) or `habitat` (a data set of the room or home).
        arkit: usdz as Apple's viewers want it: one usdc inside, Y up, without lights and scene graph.
        force: replace files that are in the way.
        physics: keep bodies, colliders, joints and the scene, or none of it; None = in flat USD alone.
        layout: number of the layout that the file holds; None = the one that the room shows. The file says which.
        pictures: take images along; without them materials have plain colours, for importers that read none (MuJoCo
            4.0 refuses JPEG).
        search: folders besides the room's own whose layers and images may be taken along.

    Raises ValueError for other endings and readers, options that a kind of file does not know, a file in the way or one
    that the room is read from, a stage that does not open, one that names files outside its folder and `search`, or a
    path that is not writable.
    """
    out = Path(out)
    if reader is not None and reader not in READERS:
        raise ValueError(f"--for is {reader!r}, allowed: {', '.join(READERS)}")
    if reader is None and out.suffix not in ENDINGS:
        raise ValueError(f"{out}: cannot export to {out.suffix or 'no ending'!r}, allowed: {', '.join(ENDINGS)}")
    kind = FORMATS[reader or out.suffix]
    asked = {"--arkit": arkit, "--physics": physics, "--no-pictures": not pictures}
    for word, wanted in asked.items():
        option = word.removeprefix("--").removeprefix("no-")
        if wanted and option not in kind.options:
            allowed = ", ".join(ending for ending, other in FORMATS.items() if option in other.options)
            raise ValueError(f"{out}: {word} says nothing to a {reader or out.suffix}, allowed: {allowed}")
    if not reader:
        check_free(out, force=force)
    elif reader == "habitat":
        check_ours(out, "data set of Habitat", "*.scene_dataset_config.json", force=force)
    stage = open_stage(room)
    reach = Reach.of(stage, search)
    reach.check_layers(stage)
    physics = kind.physics if physics is None else physics
    with showing_layout(stage, layout), reading(stage):
        files = kind.write(stage, Export(out, reach, physics, pictures, arkit))
    read = {file_of(layer.realPath).resolve() for layer in stage.GetUsedLayers() if layer.realPath}
    for path in files:
        if path.resolve() in read:
            raise ValueError(f"{path}: the room is read from it; choose another place")
        check_free(path, force=force or not reader)
    write_all(files)
    return next(iter(files))


OURS = "Echo"  # what the names of our types and schemas begin with
PROPERTIES = "echo:"


def usdz(layer: Sdf.Layer, package: Package, *, arkit: bool = False) -> bytes:
    """The package of a flat layer; for ARKit the layer is turned and stripped first, and is a usdc in the package."""
    root = package.reach.room
    if arkit:
        for_arkit(layer)
    with tempfile.TemporaryDirectory(prefix="echousd-") as scratch:
        folder = Path(scratch)
        write_all(package.files(folder))
        flat = folder / f"{root.stem}{'.usdc' if arkit else '.usda'}"
        packed = folder / "package.usdz"
        make = UsdUtils.CreateNewARKitUsdzPackage if arkit else UsdUtils.CreateNewUsdzPackage
        try:
            layer.Export(str(flat))
            whole = make(Sdf.AssetPath(str(flat)), str(packed)) and zipfile.is_zipfile(packed)
        except Tf.ErrorException:
            whole = False
        if not whole:  # USD does not say why
            raise ValueError(
                f"{root}: cannot be packed as usdz in {folder.parent}, the folder of temporary files (its disk may be "
                "full; TMPDIR names another); nothing was changed"
            )
        return without_clock(packed.read_bytes())


def for_arkit(layer: Sdf.Layer) -> None:
    """Turn a flat layer to +Y up, and take lights and the scene graph out of it: Apple's checker knows no such types.

    Labels, cameras and materials stay.
    """
    stage = Usd.Stage.Open(layer)
    if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.z:
        _turn(stage)
    for prim in list(stage.TraverseAll()):
        ours = prim.IsValid() and prim.GetTypeName().startswith(OURS)
        if ours or (prim.IsValid() and (prim.HasAPI(UsdLux.LightAPI) or prim.IsA(UsdLux.LightFilter))):
            stage.RemovePrim(prim.GetPath())
    for prim in reversed(list(stage.TraverseAll())):  # what a scope holds before the scope
        if prim.GetTypeName() == "Scope" and not prim.GetAllChildren():
            stage.RemovePrim(prim.GetPath())
    strip(layer, PROPERTIES, OURS)


def _turn(stage: Usd.Stage) -> None:
    """Z up to Y up by a matrix before the places of every prim with none above it that counts; gravity turns along."""
    turn = Gf.Matrix4d().SetRotate(Gf.Rotation(Gf.Vec3d.XAxis(), -90.0))
    for placed in list(_outermost(stage.GetPseudoRoot())):
        alone, old = placed.GetResetXformStack(), placed.GetOrderedXformOps()
        plain = all(op.GetOpName() != "xformOp:transform" for op in old)  # three.js knows no op with a suffix
        added = placed.AddTransformOp(opSuffix="" if plain else "upright")
        added.Set(turn)
        placed.SetXformOpOrder([added, *old], alone)
    for prim in stage.Traverse():
        scene = UsdPhysics.Scene(prim)
        if scene and scene.GetGravityDirectionAttr().HasAuthoredValue():
            scene.GetGravityDirectionAttr().Set(Gf.Vec3f(turn.TransformDir(scene.GetGravityDirectionAttr().Get())))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)


def _outermost(top: Usd.Prim, turned: bool = False) -> Iterator[UsdGeom.Xformable]:
    """The first prims with a place on every branch below `top`, and all that ignore what is above them."""
    for prim in top.GetChildren():
        placed = UsdGeom.Xformable(prim)
        if placed and (not turned or placed.GetResetXformStack()):
            yield placed
        yield from _outermost(prim, turned or bool(placed))


def flat_layer(stage: Usd.Stage, *, package: Package | None = None, physics: bool = True) -> Sdf.Layer:
    """Everything that a stage composes to, in one layer without references, variants or paths of this machine.

    Arguments:
        package: receives the images; without it textured materials get their plain colour.
        physics: keep bodies, colliders (and other guides), joints and the scene; all of it goes, or none.
    """
    with _without_instances(stage):
        layer = stage.Flatten(False)
    set_units(layer, stage)
    check_types(layer, source(stage))
    if not physics:
        without_physics(layer)
    stage = Usd.Stage.Open(layer)
    _drop_relations_without_ends(stage)
    for prim in stage.TraverseAll():
        prim.ClearMetadata("instanceable")
        prim.ClearMetadata("assetInfo")  # it holds the absolute path of a file that is no longer needed
        for attribute in prim.GetAttributes():
            if attribute.GetTypeName() == Sdf.ValueTypeNames.Double3 and attribute.GetName().startswith("xformOp:"):
                _as_float(attribute)  # some web loaders cannot read doubles of whole numbers from a crate file
    _bind_directly(stage)
    _drop_unused_materials(stage)
    if package is None:
        _drop_materialx(stage)
    shaders = [prim for prim in stage.TraverseAll() if prim.GetTypeName() == "Shader"]
    images = [prim for prim in shaders if (file := prim.GetAttribute("inputs:file")) and file.HasAuthoredValue()]
    take_assets(layer, package)
    for image in images:
        file = image.GetAttribute("inputs:file").Get()
        if not getattr(file, "path", ""):
            _paint_plain(image)
    return layer


@contextmanager
def _without_instances(stage: Usd.Stage) -> Iterator[None]:
    """Inside the block nothing on the stage is an instance: flat, the prototypes would be prims of their own."""
    session = stage.GetSessionLayer()
    before = Sdf.Layer.CreateAnonymous(".usda")
    before.TransferContent(session)
    try:
        with Usd.EditContext(stage, session):
            while found := [prim for prim in stage.TraverseAll() if prim.IsInstance()]:
                for prim in found:
                    prim.SetInstanceable(False)
        yield
    finally:
        session.TransferContent(before)


def _drop_relations_without_ends(stage: Usd.Stage) -> None:
    """Take out what the graph says of prims that are deactivated on the stage, as nothing is left of them here."""
    for prim in list(stage.TraverseAll()):
        kept = {name: all(map(stage.GetPrimAtPath, targets(prim, name))) for name in (SUBJECT, OBJECT, BETWEEN)}
        if not (kept[SUBJECT] and kept[OBJECT]):
            stage.RemovePrim(prim.GetPath())
        elif not kept[BETWEEN]:
            prim.RemoveProperty(BETWEEN)


def _as_float(attribute: Usd.Attribute) -> None:
    prim, name, times = attribute.GetPrim(), attribute.GetName(), attribute.GetTimeSamples()
    found = {time: attribute.Get(time) for time in (Usd.TimeCode.Default(), *times)}
    prim.RemoveProperty(name)
    single = prim.CreateAttribute(name, Sdf.ValueTypeNames.Float3, False)
    for time, value in found.items():
        if value is not None:
            single.Set(Gf.Vec3f(value), time)


def _drop_materialx(stage: Usd.Stage) -> None:
    """Networks of MaterialX that stand beside others: their images have no plain colour to fall back to."""
    for material in [UsdShade.Material(prim) for prim in stage.TraverseAll() if prim.IsA(UsdShade.Material)]:
        if material.GetSurfaceOutput("mtlx") and material.GetSurfaceOutput():
            material.GetPrim().RemoveProperty("outputs:mtlx:surface")
            for child in material.GetPrim().GetChildren():
                if str(UsdShade.Shader(child).GetShaderId() or "").startswith("ND_"):
                    stage.RemovePrim(child.GetPath())


def _paint_plain(image: Usd.Prim) -> None:
    """Give the materials that an image without a file coloured (or roughened) its fallback instead, and take it out."""
    fallback = image.GetAttribute("inputs:fallback")
    color = rgb(fallback.Get() if fallback else None, (0.5, 0.5, 0.5))
    for shader in image.GetParent().GetChildren():
        for attribute in shader.GetAttributes():
            if not any(c.GetPrimPath() == image.GetPath() for c in attribute.GetConnections()):
                continue
            attribute.ClearConnections()
            if attribute.GetTypeName() == Sdf.ValueTypeNames.Color3f:
                attribute.Set(color)
            elif attribute.GetTypeName() == Sdf.ValueTypeNames.Float:
                attribute.Set(color[0])
            else:
                shader.RemoveProperty(attribute.GetName())
    image.GetStage().RemovePrim(image.GetPath())


def _bind_directly(stage: Usd.Stage) -> None:
    """Bind every surface to the material that it shows, where a collection binds it: web viewers ask the prim alone."""
    owners = [p for p in stage.TraverseAll() if UsdShade.MaterialBindingAPI(p).GetCollectionBindingRels()]
    shown = [p for p in stage.TraverseAll() if p.IsA(UsdGeom.Gprim) or p.IsA(UsdGeom.Subset)] if owners else []
    found = [(prim, UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()[0]) for prim in shown]
    for prim in owners:
        for bound in UsdShade.MaterialBindingAPI(prim).GetCollectionBindingRels():
            name = bound.GetName().rpartition(":")[2]
            prim.RemoveProperty(bound.GetName())
            for part in ("includes", "excludes", "expansionRule", "includeRoot"):
                prim.RemoveProperty(f"collection:{name}:{part}")
            prim.RemoveAPI(Usd.CollectionAPI, name)
        if not UsdShade.MaterialBindingAPI(prim).GetDirectBindingRel().HasAuthoredTargets():
            prim.RemoveAPI(UsdShade.MaterialBindingAPI)
    for prim, material in found:
        if material and UsdShade.MaterialBindingAPI(prim).GetDirectBinding().GetMaterialPath() != material.GetPath():
            UsdShade.MaterialBindingAPI.Apply(prim).Bind(material)


def _drop_unused_materials(stage: Usd.Stage) -> None:
    """Looks of assets that the room's own looks replace."""
    bindings = ("material:binding", "material:binding:physics")
    bound = {target for prim in stage.TraverseAll() for name in bindings for target in targets(prim, name)}
    unused = [p for p in stage.TraverseAll() if p.IsA(UsdShade.Material) and p.GetPath() not in bound]
    scopes = {prim.GetParent().GetPath() for prim in unused}
    for path in [prim.GetPath() for prim in unused]:
        stage.RemovePrim(path)
    for path in scopes:
        if not stage.GetPrimAtPath(path).GetAllChildren():
            stage.RemovePrim(path)


PHYSICS = "Physics"  # what the names of all types and schemas of UsdPhysics begin with
PHYSICS_PROPERTIES = ("physics:", "physx", "drive:", "limit:", "material:binding:physics")


def without_physics(layer: Sdf.Layer) -> None:
    """Take the physics and all guides out of a flat layer, so that no engine finds half of it."""
    stage = Usd.Stage.Open(layer)
    for prim in list(stage.TraverseAll()):
        if not prim.IsValid():  # what is above it is gone
            continue
        shown = UsdGeom.Imageable(prim)
        guide = bool(shown) and shown.GetPurposeAttr().Get() == UsdGeom.Tokens.guide
        if guide or prim.GetTypeName().startswith(PHYSICS):
            stage.RemovePrim(prim.GetPath())
    strip(layer, PHYSICS_PROPERTIES, (PHYSICS, "Physx"))


def strip(layer: Sdf.Layer, properties: str | tuple[str, ...], schemas: str | tuple[str, ...]) -> None:
    """Take the properties and applied schemas whose names begin so out of every prim of a layer."""
    with Sdf.ChangeBlock():
        for spec in prim_specs(layer):
            for name in [found.name for found in spec.properties if found.name.startswith(properties)]:
                spec.RemoveProperty(spec.properties[name])
            applied = spec.GetInfo("apiSchemas").GetAddedOrExplicitItems()
            kept = [name for name in applied if not name.startswith(schemas)]
            if not kept:
                spec.ClearInfo("apiSchemas")
            elif len(kept) < len(applied):
                spec.SetInfo("apiSchemas", Sdf.TokenListOp.Create(prependedItems=kept))
