"""Lights of a room: a sky, a soft panel below the ceiling, the sun through a window, and every lamp of the graph.

The variant set `light` of `/Room` dims them for `day`, `evening` and `night`; intensities stand in its variants alone,
as a light's own opinion would be stronger than theirs.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import shapely
from pxr import Gf, UsdLux

from echomodel.openings import inward_normal, segment
from echomodel.vocabulary import vocabulary
from echousd.draw.views import view_matrix
from echousd.layers.structure import drawn
from echousd.room import RoomData
from echousd.shapes.finishes import baking
from echousd.stage.lights import SHARES
from echousd.stage.pen import Pen, layout_pens, ops

LIGHTS = "/Room/Lights"
NITS = 30.0  # cd/m² of a surface that comes to 1 in the picture: a camera in a lit room
# Lumens and kelvin of a lamp, by what it rests on. White is 6504 to a renderer, which adapts to nothing as eyes do:
# lamps of 2,700 K would turn a room orange. They are written as colours, as Blender reads no temperatures.
LAMPS = {"ceiling": (1500.0, 3700.0), "floor": (1000.0, 3100.0), "table": (450.0, 3000.0), "wall": (400.0, 3000.0)}
SKY = "textures/sky.jpg"
BULB = 0.04  # metres, radius
# Degrees of the sun over the horizon, how far it comes from the side, and kelvin at these ends.
ELEVATION, ASIDE, WARM = (26.0, 46.0), (0.2, 0.8), (5200.0, 6000.0)
# What is left of sky, sun and lamps; the sky's colour.
TIMES: Mapping[str, tuple[float, float, float]] = {
    "day": (1.0, 1.0, 0.2),
    "evening": (0.16, 0.0, 1.0),
    "night": (0.02, 0.0, 1.0),
}
HUES = {"day": (1.0, 0.97, 0.93), "evening": (0.40, 0.58, 1.0), "night": (0.30, 0.42, 0.90)}
# Lumens on a square metre of floor: what people have on at a time (the panel gives what the lamps do not, at least
# `FILL`), and from where on a camera would expose less.
LIT, FILL, BRIGHT = {"evening": 85.0, "night": 75.0}, 20.0, 160.0
Intensities = dict[str, tuple[int, float]]  # light -> its column of `TIMES`, intensity at full


def write_lights(pen: Pen, room: RoomData, bounds: np.ndarray) -> None:
    """Author `/Room/Lights` and the variant set `light`, with `day` chosen.

    Radiances are for a camera whose imaging ratio is 1 (UsdGeomCamera's default): a white surface under sky and panel
    comes to about 1, so nothing is blown out. Lamps are in the same scale, `NITS` to 1, from their lumens.

    `room`: whose lamps and windows these are. `bounds`: (2, 3) float, of the room, metres.
    """
    pen.define(LIGHTS, "Scope")
    sky: dict[str, Any] = {}
    if room.options.walls:  # who looks out of a window or over a wall sees something
        sky |= {"asset inputs:texture:file": f"./{SKY}", "token inputs:texture:format": "latlong"}
    pen.define(f"{LIGHTS}/sky", "DomeLight", sky)
    kind = "open" if not room.options.walls else "ceiling" if room.options.ceiling else "walls"
    above, share, sun = SHARES[kind]
    flux = _panel(pen, bounds, room.height)
    full: Intensities = {"sky": (0, 0.5 * above)}
    if room.options.walls:
        full |= _sun(pen, room, sun)
    lamps = _lamps(pen, room)
    full |= lamps
    area = shapely.Polygon(room.floor).area
    lumens = sum(intensity for _, intensity in lamps.values()) * np.pi * NITS / area
    for name, inside in pen.variants("/Room", "light", TIMES, "day").items():
        exposed, radiance = 1.0, share * min(20.0, 1.6 * room.height**2 * np.pi * NITS / flux)
        if name in LIT:
            exposed = min(1.0, BRIGHT / max(lumens, 1.0))
            radiance = max(LIT[name] - lumens, FILL) * area / flux
            colour = UsdLux.BlackbodyTemperatureAsRgb(LAMPS["ceiling"][1])
            inside.over(f"{LIGHTS}/ceiling", {"color3f inputs:color": colour})
        shining = {"ceiling": radiance * exposed}
        shining |= {light: intensity * TIMES[name][column] * exposed for light, (column, intensity) in full.items()}
        for light, intensity in shining.items():
            inside.over(f"{LIGHTS}/{light}", {"float inputs:intensity": round(float(intensity), 4)})
        inside.over(f"{LIGHTS}/sky", {"color3f inputs:color": HUES[name]})


def image_files(room: RoomData) -> dict[str, bytes]:
    """Path in the room's folder -> image that its lights name."""
    return {SKY: _own(room, "sky", baking.VIEWS).read_bytes()} if room.options.walls else {}


def _own(room: RoomData, what: str, among: Sequence[Any]) -> Any:
    """One of some, as the seed of a room draws it; in a home all have the first."""
    return among[0 if room.graph.room.walls else drawn(room, what, len(among))]


def _panel(pen: Pen, bounds: np.ndarray, height: float) -> float:
    """A panel below the ceiling; returns its lumens at radiance 1, of radiance L and area A it lights the floor with
    about L A / h²."""
    width, depth = (max(float(s), 0.5) for s in 0.3 * np.ptp(bounds, axis=0)[[0, 2]])
    x, _, z = (bounds.sum(0) / 2).tolist()
    values = {
        "float inputs:width": width, "float inputs:height": depth,
        **ops(translate=("double3", (x, height - 0.02, z)), rotateX=("float", -90.0)),
    }  # fmt: skip
    pen.define(f"{LIGHTS}/ceiling", "RectLight", values)
    return np.pi * NITS * width * depth


def _sun(pen: Pen, room: RoomData, irradiance: float) -> Intensities:
    """The sun through the widest window, from a little aside."""
    corners, windows = room.corners, [opening for opening in room.graph.room.openings if opening.kind == "window"]
    if not windows:
        return {}
    window = max(windows, key=lambda opening: opening.width * opening.height)
    near, far = segment(corners, window)
    side = _own(room, "side of the sun", (*np.linspace(*ASIDE, 5), *-np.linspace(*ASIDE, 5)))
    high = _own(room, "height of the sun", (0.0, 0.15, 0.3, 0.4, 0.5, 0.7, 1.0))
    level = inward_normal(corners, window.edge) + side * (far - near) / window.width
    elevation, kelvin = np.radians(np.interp(high, (0, 1), ELEVATION)), np.interp(high, (0, 1), WARM)
    level = level / np.linalg.norm(level) * np.cos(elevation)
    way = np.array([level[0], -np.sin(elevation), level[1]])
    matrix = view_matrix(-way, np.zeros(3))
    matrix[:3, 3] = 0.0
    values = {
        "float inputs:angle": 0.53,
        "bool inputs:normalize": True,  # intensity is irradiance, whatever the disc's size
        "color3f inputs:color": UsdLux.BlackbodyTemperatureAsRgb(float(kelvin)),
        **ops(transform=("matrix4d", Gf.Matrix4d(np.ascontiguousarray(matrix.T)))),
    }
    pen.define(f"{LIGHTS}/sun", "DistantLight", values)
    return {"sun": (1, irradiance)}


def _lamps(pen: Pen, room: RoomData) -> Intensities:
    """A bulb for every lamp: below what hangs, over the shade of what stands; in every layout where its lamp is."""
    rows = [vocabulary().category(node.category) for node in room.graph.nodes]
    bulbs = {n: f"lamp_{room.names[n]}" for n, row in enumerate(rows) if row.role == "light"}
    values = {
        "float inputs:radius": BULB,
        "bool inputs:normalize": True,  # intensity is radiance times area; Blender reads it so whatever stands here
        **ops(translate=("double3", None)),
    }
    for number, bulb in bulbs.items():
        colour = UsdLux.BlackbodyTemperatureAsRgb(LAMPS[rows[number].support][1])
        pen.define(f"{LIGHTS}/{bulb}", "SphereLight", {**values, "color3f inputs:color": colour})
    for boxes, inside in zip(room.layouts, layout_pens(pen, len(room.layouts)), strict=True):
        for number, bulb in bulbs.items():
            x, y, z = (float(v) for v in boxes.position[number])
            height = y - 0.06 if rows[number].support == "ceiling" else y + float(boxes.size[number][1]) + 0.06
            inside.over(f"{LIGHTS}/{bulb}", {"double3 xformOp:translate": (x, height, z)})
    return {bulb: (2, LAMPS[rows[number].support][0] / (np.pi * NITS)) for number, bulb in bulbs.items()}
