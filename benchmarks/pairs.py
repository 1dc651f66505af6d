"""Our default pictures beside those of Sweet Home 3D, of the same graphs, judged blind.

    python benchmarks/pairs.py make LOT FOLDER --count 12 --index INDEX.parquet
    SWEET=/usr/share/sweethome3d; LIBRARIES=/usr/share/java/{j3dcore,j3dutils,vecmath,batik,sunflow,janino}.jar
    CP=FOLDER:$(eval ls $SWEET/*.jar $LIBRARIES | paste -sd:)
    javac -cp $CP -d FOLDER benchmarks/SweetHomeRoom.java
    xvfb-run -a java -Djava.library.path=/usr/lib/jni -cp $CP SweetHomeRoom $SWEET/furniture FOLDER/*.txt
    python benchmarks/pairs.py shuffle FOLDER
    python benchmarks/pairs.py open FOLDER CHOICES

Debian's packages sweethome3d and sweethome3d-furniture; INDEX is `echousd assets index` of the latter, and of the
models in sweethome3d.jar, packed with their DefaultFurnitureCatalog.properties (as PluginFurnitureCatalog) into a
.sh3f. `make` draws graphs and seeds by LOT and writes of each our picture as `generate` leaves it, and what the other
program gets of the same room: floor, walls, doors, windows, the same pieces at the same places and sizes, each as the
model of its class in its catalogues that `--shapes library` would take, small things of which they have a class where
ours lie, the same eye. Floors, lights, sky and quality are that program's own. `shuffle` makes FOLDER/pair_N.png, A
beside B, of which a lot says whose is whose, and FOLDER/key.json. `open` reads lines `N WHOLE MATERIALS SHAPES
LIVELINESS`, each A, B or =, and says who won.
"""

from __future__ import annotations

import argparse
import json
import secrets
import warnings
from collections import Counter
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw
from pxr import Gf, Usd, UsdGeom
from room_sheets import drawn_by_lot, graphs_of

from echomodel.openings import inward_normal, segment
from echomodel.vocabulary import vocabulary
from echousd import generate
from echousd.assets.choose import Asked, AssetWishes, choose
from echousd.assets.table import read_library
from echousd.dressing.dress import dressed
from echousd.room import RoomData
from echousd.shapes import walls

FLOORS = ("eTeks#woodenFloor", "eTeks#oldWoodenFloor")
WALL = 0.15  # metres
# Ids of models for our kinds of small things, one of them by lot.
SMALL = {
    "picture": ("eTeks#frame", "Scopia#frame1", "Scopia#frame2"), "photo": ("eTeks#frame",),
    "sheer_curtain": ("Scopia#curtain",), "curtain": ("eTeks#curtains",), "blind": ("eTeks#blind",),
    "round_rug": ("Scopia#round-carpet",), "rug": ("Kator Legaz#oriental-rug",),
    "radiator": (
        "Blend Swap CC-0#radiator", "Blend Swap CC-0#radiator1", "Blend Swap CC-0#radiator2",
        "Blend Swap CC-0#radiator3", "Blend Swap CC-BY#modernRadiator",
    ),
    "socket": ("Scopia#square-plug-TypeCFlat",), "clock": ("Blend Swap CC-BY#clock",),
    "floor_plant": (
        "Blend Swap CC-0#decorativePlant", "Blend Swap CC-BY#mediumIndoorPlant", "Blend Swap CC-BY#yuccaPlant",
        "Scopia#ficus", "Scopia#maceta", "eTeks#plant",
    ),
    "small_plant": (
        "Blend Swap CC-0#littlePlant", "Blend Swap CC-0#orchids", "Blend Swap CC-BY#spatifilum",
        "Blend Swap CC-BY#spider_plant", "Blend Swap CC-BY#succulentPlant",
    ),
    "flowers": (
        "eTeks#flowers", "Blend Swap CC-BY#tulip", "Blend Swap CC-BY#tulips", "Scopia#calla_lily_with_roses",
    ),
    "vase": ("Scopia#vase1", "Scopia#vase2", "Scopia#vase3", "Scopia#jar", "Scopia#vase5"),
    "book": ("Blend Swap CC-BY#book",), "cup": ("Blend Swap CC-0#caffe_final", "Blend Swap CC-BY#coffee_cup"),
    "glass": ("Kator Legaz#12-oz-glass", "Blend Swap CC-BY#glass"),
    "candles": ("Scopia#candle", "Scopia#complements2"),
    "bowl": ("Scopia#bowlWithFruits", "Scopia#bowlWithSalad", "Kator Legaz#bowl"), "tray": ("Scopia#tray",),
    "teapot": ("Scopia#teapot",), "wine": ("Scopia#wine_bottle", "Kator Legaz#red-wine-bottle-01"),
    "laptop": ("Blend Swap CC-BY#laptop", "eTeks#laptop"), "television": ("eTeks#flatTV",),
    "remote": ("Scopia#tv-remote-control",), "headphones": ("Blend Swap CC-0#headphones",),
    "bear": ("Blend Swap CC-0#teddyBear",), "train": ("Blend Swap CC-BY#toyTrain",),
    "tent": ("Blend Swap CC-0#childHut",), "dolls_house": ("Scopia#doll-house",),
    "skateboard": ("Scopia#skateboard",), "slippers": ("Blend Swap CC-0#slippers",), "shoes": ("Scopia#sneakers",),
    "backpack": ("Blend Swap CC-BY#backpack",), "suitcase": ("Blend Swap CC-BY#suitcase",),
    "basket": ("Scopia#clothes-basket", "Scopia#shopping-basket"), "pouf": ("Scopia#puff",),
    "towel": ("Blend Swap CC-0#towel2", "Scopia#com_bath3_toalla"), "hung_coats": ("Kator Legaz#hanging-clothes1",),
    "magazine": ("Kator Legaz#newspaper",), "plate": ("Kator Legaz#plate-and-ustensils",),
}  # fmt: skip


def told(room: RoomData, library: AssetWishes, seed: int) -> tuple[list[str], list[str]]:
    """Lines for the other program, centimetres, and the names of what its catalogues have nothing for."""
    corners = np.asarray(room.floor if room.graph.room.corners is None else room.graph.room.corners, float)
    outer = walls.outline(corners, [WALL / 2] * len(corners))
    luck = np.random.default_rng(seed)
    lines = [f"height\t{100 * room.height:.1f}", "\t".join(["floor", str(luck.choice(FLOORS)), *_cm(corners)])]
    lines += ["\t".join(["wall", *_cm([one, two])]) for one, two in zip(outer, np.roll(outer, -1, 0), strict=True)]
    for opening in room.graph.room.openings:
        inside = inward_normal(corners, opening.edge)
        middle = segment(corners, opening).mean(0) - WALL / 2 * inside
        kind = "door" if opening.kind == "door" else "doorFrame"
        if opening.kind == "window":
            tall, wide = opening.sill < 0.2, opening.width > 1.1
            kind = ("doubleFrenchWindow126x200" if wide else "frenchWindow85x200") if tall else (
                "doubleWindow126x163" if wide else "window85x163")  # fmt: skip
        size, yaw = (opening.width, opening.height, WALL), float(np.arctan2(*inside))
        lines.append(_piece(f"eTeks#{kind}", size, np.insert(middle, 1, opening.sill), yaw))
    asked = [
        Asked(node.name, node.category, "room", tuple(map(float, room.boxes.size[n])), room.assets[node.name])
        for n, node in enumerate(room.graph.nodes)
    ]  # fmt: skip
    found, missing = choose(library, asked, seed)
    for number, node in enumerate(room.graph.nodes):
        if node.name in found:
            at = (room.boxes.size[number], room.boxes.position[number], float(room.boxes.yaw[number]))
            lines.append(_piece(found[node.name].uri.partition("!")[2], *at))
    for thing in dressed(room).placed:
        models = next((models for word, models in SMALL.items() if word in thing.kind), ())
        if models:
            model = models[thing.variant % len(models)]
            lines.append(_piece(model, thing.size, thing.position, thing.yaw))
    return lines, missing


def _cm(points: object) -> list[str]:
    return [f"{100 * value:.1f}" for value in np.ravel(points)]


def _piece(model: str, size: object, position: object, yaw: float) -> str:
    x, y, z = np.asarray(position, float)
    w, h, d = np.asarray(size, float)
    return "\t".join(["piece", model, *_cm([x, z, y, w, d, h]), f"{-yaw:.5f}"])


def eye(stage: Usd.Stage) -> str:
    """The camera of a room as a line: place, yaw, pitch and degrees across in radians; a shift becomes a turn."""
    camera = UsdGeom.Camera(stage.GetPrimAtPath("/Room/Cameras/perspective")).GetCamera(0)
    matrix = np.array(Gf.Matrix4d(camera.transform)).T
    (x, y, z), aside = matrix[:3, 3], camera.horizontalApertureOffset / camera.focalLength
    ahead = aside * matrix[:3, 0] - matrix[:3, 2]
    pitch = np.arctan2(-camera.verticalApertureOffset, camera.focalLength)  # ours are level and shifted
    across = 2 * np.arctan2(camera.horizontalAperture / 2, camera.focalLength)
    return "\t".join(
        ["camera", *_cm([x, z, y]), *(f"{v:.5f}" for v in (np.arctan2(-ahead[0], ahead[2]), pitch, across))]
    )


def make(lot: int, folder: Path, count: int, index: Path) -> None:
    """Our pictures and the other program's rooms."""
    folder.mkdir(parents=True, exist_ok=True)
    library, missing = AssetWishes(read_library(index), outside=(Path("/"),)), Counter[str]()
    graphs = [(name, graph) for name, graph in graphs_of(["samples", "people", "more"])]
    for number, (name, graph, seed) in enumerate(drawn_by_lot(graphs, count, lot)):
        room = generate(graph, seed=seed)
        root = room.save(folder / f"ours_{number}")
        Image.open(root.with_suffix(".png")).save(folder / f"ours_{number}.png")
        lines, without = told(room, library, seed)
        lines.append(eye(Usd.Stage.Open(str(root))))
        (folder / f"theirs_{number}.txt").write_text("\n".join(lines) + "\n")
        missing.update(vocabulary().category(room.graph.node(one).category).name for one in without)
        print(f"{number} {name} {seed}: {len(room.names)} pieces, without {len(without)}", flush=True)
    print("no model for", dict(missing))


def shuffle(folder: Path) -> None:
    """A beside B on one picture each, whose is whose by lot."""
    key = {}
    for path in sorted(folder.glob("theirs_*.png")):
        number = path.stem.removeprefix("theirs_")
        pair = [("ours", folder / f"ours_{number}.png"), ("theirs", path)]
        if secrets.randbits(1):
            pair.reverse()
        sheet = Image.new("RGB", (1300, 430), "white")
        for place, (_, one) in enumerate(pair):
            sheet.paste(Image.open(one).convert("RGB").resize((640, 400)), (660 * place, 30))
            ImageDraw.Draw(sheet).text((660 * place + 4, 8), "AB"[place], fill="black")
        sheet.save(folder / f"pair_{number}.png")
        key[number] = [who for who, _ in pair]
    (folder / "key.json").write_text(json.dumps(key))


def opened(folder: Path, choices: Path) -> None:
    """Who won what."""
    key = json.loads((folder / "key.json").read_text())
    won = [Counter[str]() for _ in range(4)]
    for line in choices.read_text().splitlines():
        number, *chosen = line.split()[:5]
        names = [key[number]["AB".index(one)] if one in "AB" else "=" for one in chosen]
        print(f"{number:>3} A={key[number][0]}: {' '.join(names)}")
        for counter, one in zip(won, names, strict=True):
            counter[one] += 1
    for what, counter in zip(("whole", "materials and light", "shapes", "liveliness"), won, strict=True):
        print(what, dict(counter))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    steps = parser.add_subparsers(dest="step", required=True)
    step = steps.add_parser("make")
    step.add_argument("lot", type=int)
    step.add_argument("folder", type=Path)
    step.add_argument("--count", type=int, default=12)
    step.add_argument("--index", type=Path, required=True)
    steps.add_parser("shuffle").add_argument("folder", type=Path)
    step = steps.add_parser("open")
    step.add_argument("folder", type=Path)
    step.add_argument("choices", type=Path)
    asked = parser.parse_args()
    warnings.simplefilter("ignore")
    if asked.step == "make":
        make(asked.lot, asked.folder, asked.count, asked.index)
    elif asked.step == "shuffle":
        shuffle(asked.folder)
    else:
        opened(asked.folder, asked.choices)


if __name__ == "__main__":
    main()
