"""Patterns, their images, and the harmonies of a room."""

import io
import json
import re
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image
from pxr import Usd, UsdShade
from small_room import BARE, StandIn, small_graph

import echousd
from echomodel.dressing import ASPECTS, PRINTS
from echomodel.furniture.solids import Block
from echomodel.triangles import Mesh
from echousd.checks.reading import Reading
from echousd.checks.report import find_faults
from echousd.exporting.formats import export
from echousd.graph import starting_graph
from echousd.layers.compose import room_files
from echousd.options import RoomOptions
from echousd.shapes.finishes import baking, pictures
from echousd.shapes.finishes.media import MEDIA, PRESS, worked
from echousd.shapes.finishes.patterns import SIZE, creased, noise, relief
from echousd.shapes.finishes.pictures import PROGRAMS, STOCK, printed
from echousd.shapes.finishes.slots import HARMONIES, SLOTS, linear, material_of
from echousd.shapes.geometry import CREASE, Origin
from echousd.shapes.joinery import assembled
from echousd.shapes.looks import SHOWN, alternatives, look
from echousd.shapes.surface import surfaces


@pytest.mark.parametrize("name", sorted({row.pattern for row in SLOTS.values()} - {"", *PRINTS}))
def test_patterns_tile_and_keep_their_colour(name):
    tone = relief(name).tone
    assert np.isfinite(tone).all()
    assert 0.85 < tone.mean() < 1.15
    inside = np.abs(np.diff(tone, axis=1)).reshape(len(tone), len(tone[0]) - 1, -1).mean((0, 2)).max()
    seam = np.abs(tone[:, 0] - tone[:, -1]).mean()
    assert seam < 1.5 * inside + 0.02, "a seam between two tiles"


def test_images_hold_the_colour_that_was_asked_for():
    color = linear("b98f5f")
    content = baking.color_image("wood", color, "oak")
    assert content == baking.color_image.__wrapped__("wood", color, "oak")
    pixels = (np.asarray(Image.open(io.BytesIO(content))) / 255) ** 2.2
    assert pixels.shape == (SIZE, SIZE, 3)
    assert pixels.mean((0, 1)) == pytest.approx(color, abs=0.03)
    normal = np.asarray(Image.open(io.BytesIO(baking.normal_image("woven", 0.9)))) / 127.5 - 1
    assert np.linalg.norm(normal, axis=-1) == pytest.approx(1, abs=0.2)
    assert normal[..., 2].min() > 0
    assert baking.normal_image("leaf", 0.3) is None


def test_cloth_lies_in_folds_that_go_on_beyond_the_picture():
    height = creased()
    for axis in (0, 1):
        step, around = np.abs(np.diff(height, axis=axis)), np.abs(height.take(0, axis) - height.take(-1, axis))
        assert around.max() <= step.max()
    slope = np.hypot(*np.gradient(height)) * SIZE
    assert 0.12 < np.quantile(slope, 0.95) < 0.4  # seen, and not like crumpled paper
    assert np.quantile(slope, 0.95) > 3 * np.median(slope)  # most of it is smooth


def test_images_are_small_and_keep_normals_whole():
    """Pixels are coded by what is in them; hues at half the places, where they are no normals."""
    for image, places in ((pictures.color_image("wood", (0.5, 0.4, 0.3), "oak"), 2),
                          (pictures.normal_image("linen", 0.9), 1)):  # fmt: skip
        read, plain = Image.open(io.BytesIO(image)), io.BytesIO()
        assert [layer[1:3] for layer in read.layer] == [(places, places), (1, 1), (1, 1)]
        read.save(plain, "JPEG", qtables=read.quantization, subsampling=2 * (places > 1))
        assert len(image) < 0.95 * len(plain.getvalue())


def test_what_ships_is_coded_by_what_is_in_it():
    first, plain = bytes.fromhex("00 00010501010101010100000000000000"), io.BytesIO()  # a table that fits no image
    Image.new("RGB", (8, 8)).save(plain, "JPEG")
    assert first in plain.getvalue()
    assert len(baking.VIEWS) >= 8
    for file in (*baking.VIEWS, *baking.BAKED.glob("*.jpg")):
        assert first not in file.read_bytes(), file.name


def test_noise_that_images_share_is_made_once():
    kinds = {row.get("kind"): name for name, row in PRINTS.items() if row.get("kind") and "cloud" not in str(row)}
    for missed in (None, 0):
        before = noise.cache_info().misses
        for name in ("wood", "rumpled", *kinds.values(), next(name for name in PRINTS if "cushion_" in name)):
            pictures.color_image(name, (0.5, 0.4, 0.3), "oak", 0.1)
        assert missed is None or noise.cache_info().misses - before == missed
    assert len(kinds) >= 5


def test_every_slot_has_a_look_in_every_harmony():
    assert len(HARMONIES) >= 20
    for harmony in HARMONIES:
        for slot in SLOTS:
            assert all(0 <= c <= 1 for c in look(harmony, slot).color)
        assert look(harmony, "wood", 0) != look(harmony, "wood", 1)
        assert look(harmony, "fabric", 0) != look(harmony, "fabric", 1)


@pytest.mark.parametrize("harmony", HARMONIES)
def test_no_cloth_of_furniture_is_nearly_as_bright_as_the_walls(harmony):
    """The second one of some was: sofas of it glared white in the sun."""
    bright, tones = np.array([0.2126, 0.7152, 0.0722]), HARMONIES[harmony]
    for cloth in (tones["cloth"], tones["cloth2"]):
        assert bright @ linear(cloth) < 0.7 * bright @ linear(tones["wall"])


def test_harmonies_say_how_glossy_and_how_worn_their_materials_are():
    slots = {"wood": "floor", "metal": "metal", "cloth": "fabric", "wall": "wall"}
    told = {word: [look(harmony, slot) for harmony in HARMONIES] for word, slot in slots.items()}
    for word, looks in told.items():
        assert len({one.gloss for one in looks}) > 4, word
        assert len({one.worn for one in looks}) > 4, word
        assert all(0.1 < one.rough <= 1 and 0 <= one.worn < 0.1 for one in looks)
    assert look("ink", "ceramic").rough == look("oak", "ceramic").rough
    new, old = (np.asarray(Image.open(io.BytesIO(baking.color_image("wood", (0.3, 0.2, 0.1), "oak", worn))), float)
                for worn in (0.0, 0.03))  # fmt: skip
    assert np.abs(new.mean((0, 1)) - old.mean((0, 1))).max() < 2
    patches = [image[..., 0].reshape(16, 32, 16, 32).mean((1, 3)).std() for image in (new, old)]
    assert patches[1] > 1.2 * patches[0]


def test_boards_of_a_floor_differ_and_paint_hides_the_grain():
    planks = relief("planks").tone
    middles = planks[np.arange(18) * len(planks) // 18 + 28].reshape(18, 16, -1, 3).mean((2, 3))
    assert np.corrcoef(middles).max(where=~np.eye(18, dtype=bool), initial=-1) < 0.95
    assert middles.std() > 0.05
    wood, paint = (
        np.asarray(Image.open(io.BytesIO(baking.color_image("veneer", color, "oak", 0.03))), float).std((0, 1)).max()
        for color in (linear("b98f5f"), linear("dfe4e4"))
    )
    assert paint < 0.4 * wood


def test_fibres_run_along_the_longer_side_of_a_board():
    boards = [
        Block(centre=np.array([0, 0.5, 0.0]), half=np.array([0.02, 0.5, 0.02])),
        Block(centre=np.array([0.5, 0.02, 0.0]), half=np.array([0.48, 0.02, 0.05])),
    ]
    made = assembled(boards, np.array([1.0, 1.0, 0.1]), faces=500, origin=Origin("parts"))
    form = surfaces([(made.parts[0].mesh, made.parts[0].slots, CREASE)])[0]
    corners, st = form.points[form.faces], form.st[form.st_index].reshape(-1, 3, 2)
    extent, spread = np.ptp(corners, axis=1), np.ptp(st, axis=1) * SLOTS["wood"].metres
    long = extent.max(1) > 0.8
    assert long.any()
    assert spread[long, 0] == pytest.approx(extent[long].max(1), abs=0.02)


@pytest.mark.parametrize(("slot", "along"), [("brick", 0), ("wallpaper", 0), ("wood", 1)])
def test_bricks_lie_on_a_wall_that_is_higher_than_long(slot, along):
    mesh = Mesh(np.array([(0, 0, 0), (1, 0, 0), (1, 2.6, 0), (0, 2.6, 0)], float), np.array([(0, 1, 2), (0, 2, 3)]))
    form = surfaces([(mesh, {slot: np.arange(2)}, CREASE)])[0]
    assert np.ptp(form.st, axis=0)[along] == pytest.approx(1.0 / SLOTS[slot].metres, abs=1e-4)


@pytest.fixture(scope="module")
def root(tmp_path_factory):
    room = echousd.generate(small_graph(), seed=3, model=StandIn(), place=False, shapes="boxes", **BARE)
    room = replace(room, options=RoomOptions(dress="full", walls=True))
    return room.save(tmp_path_factory.mktemp("rooms") / "bedroom", preview=False)


def test_palettes_are_variants_that_change_colours_alone(root):
    stage = Usd.Stage.Open(str(root))
    variants = stage.GetPrimAtPath("/Room").GetVariantSet("palette")
    chosen, shown = variants.GetVariantSelection(), []
    assert set(variants.GetVariantNames()) == set(alternatives(chosen))
    for name in variants.GetVariantNames():
        variants.SetVariantSelection(name)
        image = UsdShade.Shader(stage.GetPrimAtPath("/Room/Looks/floor/image"))
        shown.append(tuple(image.GetInput("scale").Get()))
        if name == chosen:
            assert shown[-1] == (1, 1, 1, 1)
    assert len(set(shown)) == SHOWN
    assert stage.GetCompositionErrors() == []


def test_images_are_there_and_small(root):
    images = [path for path in (root.parent / "textures").iterdir() if path.suffix == ".jpg"]
    assert images
    assert sum(path.stat().st_size for path in images) < 3e6
    stage = Usd.Stage.Open(str(root))
    for prim in stage.Traverse():
        shader = UsdShade.Shader(prim)
        if shader and shader.GetInput("file"):
            assert shader.GetInput("file").Get().resolvedPath, prim


def test_materialx_stands_beside_preview_surfaces(root, tmp_path):
    plain = Usd.Stage.Open(str(root))
    room = echousd.generate(small_graph(), seed=3, model=StandIn(), place=False, shapes="boxes", **BARE)
    room = replace(room, options=RoomOptions(dress="full", walls=True, materialx=True))
    made = room.save(tmp_path / "bedroom", preview=False)
    assert json.loads(made.with_suffix(".json").read_text())["materialx"] is True
    stage = Usd.Stage.Open(str(made))
    assert stage.GetCompositionErrors() == []
    names = stage.GetPrimAtPath("/Room").GetVariantSet("palette").GetVariantNames()
    tints = {name: _tint_of(stage, name) for name in names}
    assert len(set(tints.values())) == SHOWN
    for prim in stage.GetPrimAtPath("/Room/Looks").GetChildren():
        material = UsdShade.Material(prim)
        assert not UsdShade.Material(plain.GetPrimAtPath(prim.GetPath())).GetSurfaceOutput("mtlx")
        assert material.ComputeSurfaceSource("mtlx")[0].GetShaderId() == "ND_UsdPreviewSurface_surfaceshader"
        assert material.ComputeSurfaceSource()[0].GetShaderId() == "UsdPreviewSurface"
        for child in prim.GetChildren():
            shader = UsdShade.Shader(child)
            if shader.GetShaderId().startswith("ND_image") and shader.GetInput("file").Get():
                assert shader.GetInput("file").Get().resolvedPath, child
            if shader.GetShaderId() == "ND_multiply_color3":
                scale = UsdShade.Shader(prim.GetChild("image")).GetInput("scale").Get()
                factor = shader.GetInput("in2").Get()
                assert tuple(factor) == pytest.approx(tuple(scale)[:3] if scale else (1, 1, 1))
    assert find_faults(Reading(stage)) == ((), ())
    flat = Usd.Stage.Open(str(export(made, tmp_path / "flat.usdc", pictures=False)))
    floor = UsdShade.Material(flat.GetPrimAtPath("/Room/Looks/floor"))
    assert not floor.GetSurfaceOutput("mtlx")
    assert {child.GetName() for child in floor.GetPrim().GetChildren()} == {"surface", "st"}


def _tint_of(stage, harmony):
    stage.GetPrimAtPath("/Room").GetVariantSet("palette").SetVariantSelection(harmony)
    return tuple(UsdShade.Shader(stage.GetPrimAtPath("/Room/Looks/floor/mtlx_tint")).GetInput("in2").Get())


def test_labels_say_what_things_are_made_of():
    told = {"a_b_book_b": "paper", "room_rug_lattice": "wool", "picture_fern": "print", "style_accent_plain": "fabric"}
    told |= {"door_leaf": "wood", "plant_leaf": "foliage", "wallpaper": "paper", "wall": "plaster", "glass": "glass"}
    assert {name: material_of(name) for name in told} == told
    words = {material_of(f"suite_{slot}") for slot in SLOTS}
    assert words <= {
        "brick", "ceramic", "fabric", "foliage", "fruit", "glass", "leather", "linen", "metal", "paper", "plaster",
        "print", "soil", "stone", "wax", "wicker", "wood", "wool",
    }  # fmt: skip


def test_a_baked_image_is_kept_for_later_processes(tmp_path, monkeypatch):
    """The same bytes without baking; what is damaged, or was baked by other programs, is baked anew."""
    monkeypatch.setenv("ECHOUSD_CACHE", str(tmp_path / "cache"))
    baked = []

    @baking.kept
    def image(pattern, size):
        baked.append(pattern)
        return b"" if size is None else pattern.encode() * size

    def later(*asked):
        image.cache_clear()
        return image(*asked)

    assert [later("oak", 3), later("oak", 3), later("elm", None), later("elm", None)] == [b"oakoakoak"] * 2 + [None] * 2
    assert baked == ["oak", "elm"]
    for file in (tmp_path / "cache/images").iterdir():
        file.write_bytes(file.read_bytes()[:-1] + b"?")
    assert later("oak", 3) == b"oakoakoak"
    assert baked == ["oak", "elm", "oak"]
    monkeypatch.setattr(baking, "_code", lambda: "of later")
    assert later("oak", 3) == b"oakoakoak"
    assert len(baked) == 4
    monkeypatch.setenv("ECHOUSD_CACHE", str(tmp_path / "file"))
    (tmp_path / "file").touch()
    assert later("oak", 3) == b"oakoakoak"
    assert len(baked) == 5


@pytest.mark.parametrize("what", ["picture", "rug", "cushion"])
def test_no_two_prints_are_nearly_the_same(what, monkeypatch):
    """What hangs or lies in fifty rooms is not met all the time, and can be read where it is."""
    names = [name for name in PRINTS if name.startswith(f"{what}_")]
    for module in ("pictures", "patterns", "media"):  # an eighth of this is looked at
        monkeypatch.setattr(f"echousd.shapes.finishes.{module}.SIZE", SIZE // 4)
        monkeypatch.setattr(f"echousd.shapes.finishes.{module}.noise", noise.__wrapped__)
    monkeypatch.setattr("echousd.shapes.finishes.patterns.creased", creased.__wrapped__)
    drawn = [printed(name, "clay")[::2, ::2] for name in names]
    apart = [float(np.abs(one - other).mean()) for k, one in enumerate(drawn) for other in drawn[:k]]
    assert min(apart) > 0.02
    for name, image in zip(names, drawn, strict=True):
        assert image.shape == (SIZE // 8, SIZE // 8, 3)
        assert 0 <= image.min() <= image.max() <= 1
        assert image.std((0, 1)).max() > 0.025, name


@pytest.mark.parametrize("harmony", HARMONIES)
def test_what_is_printed_names_colours_and_programs_that_there_are(harmony):
    tones = HARMONIES[harmony].keys() | STOCK.keys()
    for name, row in PRINTS.items():
        words = [row.get("on", "paper"), *(word for one in row["of"] for word in one.get("colors", [one.get("color")]))]
        assert all(word in tones or re.fullmatch("[0-9a-f]{6}", word) for word in words), name
        assert {next(iter(one)) for one in row["of"]} <= PROGRAMS.keys(), name
        assert row["form"] in ASPECTS


@pytest.mark.parametrize("medium", sorted({*MEDIA.values(), PRESS}))
def test_paint_lies_unevenly_and_leaves_bare_paper_alone(medium):
    image = Image.new("RGB", (2 * SIZE, 2 * SIZE), "#f4efe6")
    image.paste("#3f6b8a", (0, 0, SIZE, 2 * SIZE))
    made = worked(image, (0xF4, 0xEF, 0xE6), medium, 7)
    assert made[:, -SIZE // 8 :] == pytest.approx(np.broadcast_to(linear("f4efe6"), (SIZE, SIZE // 8, 3)), abs=1e-4)
    painted = made[:, SIZE // 8 : SIZE // 3]
    assert painted.mean((0, 1)) == pytest.approx(linear("3f6b8a"), abs=0.06)
    assert painted.std((0, 1)).max() > 0.02


def test_a_print_is_in_the_colours_of_the_harmony_and_round_things_are_round():
    assert np.abs(printed("rug_checked", "coast") - printed("rug_checked", "terra")).mean() > 0.05
    ink = (np.abs(printed("picture_dots", "oak") - linear("2d3136")) < 0.02).all(-1)
    rows, columns = np.argwhere(ink).T
    one = (rows < SIZE / 7) & (columns < SIZE / 5)
    assert np.ptp(columns[one]) * ASPECTS["tall"] == pytest.approx(np.ptp(rows[one]), rel=0.1)


def test_images_that_ship_are_what_would_be_baked():
    every = json.loads((baking.BAKED / "index.json").read_text())
    assert {*every, "index.json"} == {file.name for file in baking.BAKED.iterdir()}
    for file, (name, given) in every.items():
        given = tuple(tuple(one) if isinstance(one, list) else one for one in given)
        assert baking.baked_file(name, given).name == file
        shipped, baked = (baking.BAKED / file).read_bytes(), getattr(pictures, name)(*given) or b""
        assert bool(shipped) == bool(baked)
        if shipped:  # other versions of libraries round otherwise
            far = np.subtract(*(np.asarray(Image.open(io.BytesIO(one)), int) for one in (shipped, baked)))
            assert np.abs(far).mean() < 0.5, (name, given)


def test_first_rooms_bake_next_to_nothing(monkeypatch, tmp_path):
    asked, baked = [], []
    for name in ("color_image", "normal_image", "rough_image"):
        image = baking.kept(lambda *given, name=name: baked.append((name, given)))
        image.__name__ = name
        monkeypatch.setattr(baking, name, lambda *given, image=image: asked.append(given) or image(*given))
    monkeypatch.setattr(baking, "from_cache", lambda kind, key, make: make())
    room = echousd.generate(starting_graph("bedroom"), progress=None)
    relief("planks")
    room_files(room)
    assert relief.cache_info().currsize == 0, "the picture of the room has less room"
    assert len(set(asked)) > 40
    assert len(baked) < 6, f"{baked}: run docs/make_baked.py"
