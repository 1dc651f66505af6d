"""Where things stand in a room: prim paths and names, files of an asset."""

ROOM = "/Room"
OBJECTS = "/Room/Objects"
SHELL = "/Room/Shell"
OPENINGS = "/Room/SceneGraph/Openings"
DRESSING = "/Room/Dressing"
UNFIT = "layers/unfit.usda"  # the layer of ours that mutes what of a painted look fits no longer
CLASSES = "_class_"  # the prim that an asset's class stands below
GEO, MTL = "geo", "mtl"  # scopes of an asset: what is seen and what collides, and what it is made of
DESCRIPTION = "echo:description"  # attribute of an asset's root: what the furniture branch said of it


def layer_file(name: str, *, crate: bool = False) -> str:
    """Path of one of the room's layers in its folder; the shell's meshes are no text, with `crate` none is."""
    return f"layers/{name}.{'usdc' if crate or name == 'shell' else 'usda'}"


def piece_name(asset: str, piece: str) -> str:
    """Name of the prim of a part or collider; unique in the room, because some importers keep only names."""
    return f"{asset}_{piece}"


def piece_path(root: str, asset: str, piece: str, body: str = "") -> str:
    """Path of the prim of a part or collider in the scope `geo` of its asset, or below the body that it moves with."""
    above = f"{root}/{GEO}/{piece_name(asset, body)}" if body else f"{root}/{GEO}"
    return f"{above}/{piece_name(asset, piece)}"


def piece_of(asset: str, prim: str) -> str | None:
    """The part or collider that a prim's name says, None if it is not named for this asset."""
    piece = prim.removeprefix(f"{asset}_")
    return None if piece == prim else piece


def layer_name(asset: str, part: str = "") -> str:
    """File name of an asset's component layer, or of its geometry beside that: `geo`, or `low` with few faces."""
    return f"{asset}_{part}.usdc" if part else f"{asset}.usda"


def asset_file(asset: str, part: str = "") -> str:
    """Path in the room's folder of one of an asset's layers, see `layer_name`; not every asset has one of few faces."""
    return f"assets/{asset}/{layer_name(asset, part)}"


def original_file(asset: str, path: str) -> str:
    """Path in the room's folder of a file of somebody else's model that the asset holds."""
    return f"assets/{asset}/original/{path}"


def thumbnail_file(asset: str) -> str:
    """Path of an asset's picture in the room's folder; not every asset has one."""
    return f"assets/{asset}/.thumbs/256x256/{asset}.usda.png"


def class_path(asset: str) -> str:
    """Path of an asset's class, whose opinions reach all its users."""
    return f"/{CLASSES}/{asset}"
