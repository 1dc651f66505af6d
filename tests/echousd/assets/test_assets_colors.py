import numpy as np
import pytest
from small_models import chest, picture, seat, write_glb, write_obj, write_usd

from echousd.assets import table
from echousd.assets.choose import Asked, AssetWishes, choose
from echousd.assets.colors import costs, dominant, flat, oklab, stated_colors, swatches, texels
from echousd.assets.colors import table as rows_of
from echousd.assets.index import index
from echousd.assets.table import read_library

GREYS = np.array([[0.8, 0.8, 0.8], [0.1, 0.1, 0.1]])


def painted(folder, name, color, mesh=None):
    write_obj(folder, name, mesh or seat(0.8, 0.9, 0.8), texture=f"{name}.png")
    (folder / f"{name}.png").write_bytes(picture(color))


def near(record, color):
    return np.abs(np.array(swatches(record.colors)[0][1]) - color).max() <= 3


def test_oklab_is_that_of_its_paper_and_comes_back():
    found = oklab(np.array([[1.0, 1.0, 1.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]))
    np.testing.assert_allclose(found, [[1, 0, 0], [0.628, 0.2249, 0.1258], [0.452, -0.0325, -0.3115]], atol=1e-3)
    assert swatches(dominant([(1.0, flat((1, 0, 0)))])) == [(1.0, (255, 0, 0))]


def test_large_surfaces_count_more_and_glass_less():
    red, white = flat((0.5, 0.01, 0.01)), flat((0.9, 0.9, 0.9))
    assert [share for share, _ in swatches(dominant([(3.0, white), (1.0, red)]))] == [0.75, 0.25]
    glass = flat((0.9, 0.9, 0.9), 0.1)
    assert swatches(dominant([(3.0, glass), (1.0, red)]))[0][0] > 0.7
    assert len(swatches(dominant([(99.0, white), (1.0, red)]))) == 1  # a handle is no colour of a wardrobe
    assert dominant([]) == ()
    assert texels(b"no image") is None


def test_models_of_every_kind_have_their_colors(tmp_path):
    painted(tmp_path / "models", "armchair", (200, 30, 30))
    write_obj(tmp_path / "models", "chair", seat(), texture="missing/oak.png")  # its plain colour is white
    write_glb(tmp_path / "models", "nightstand", chest(0.5, 0.5, 0.4))
    write_usd(tmp_path / "models/desk.usda", chest(), texture="./armchair.png")
    write_usd(tmp_path / "models/dresser.usda", chest())
    found = read_library(index([tmp_path / "models"], tmp_path / "lib.parquet").file).records
    assert near(found["armchair.obj"], (200, 30, 30))
    assert near(found["chair.obj"], (255, 255, 255))
    assert near(found["nightstand.glb"], (30, 160, 60))
    assert near(found["desk.usda"], (200, 30, 30))
    assert near(found["dresser.usda"], (89, 124, 218))  # 0.1 0.2 0.7 linear


def test_loud_colors_are_chosen_where_the_graph_tells_them_alone(tmp_path):
    for name, color in {"white": (235, 235, 232), "black": (30, 30, 30), "hot": (225, 20, 40)}.items():
        painted(tmp_path / "models", f"armchair_{name}", color)
    wishes = AssetWishes(read_library(index([tmp_path / "models"], tmp_path / "lib.parquet").file))

    def found(told="", wishes=wishes, palette=GREYS):
        asked = [Asked("seat", "armchair", "room", (0.8, 0.9, 0.8), "", told)]
        return {choose(wishes, asked, seed, palette=palette)[0]["seat"].id[9:-4] for seed in range(12)}

    assert found() == {"white", "black"}
    assert found(told="red") == {"hot"}
    assert found(told="black leather") == {"black"}
    assert found(palette=None) == {"white", "black", "hot"}  # nothing is known of the room
    assert found(palette=np.array([[0.75, 0.01, 0.02]])) == {"white", "black", "hot"}  # a red room


def test_plants_may_have_any_color_and_unknown_ones_cost_nothing():
    rows = rows_of([(1.0, 0.6, 0.2, 0.1), ()], 3)
    tones, none = oklab(GREYS), np.zeros((0, 3))
    assert costs(rows, "armchair", tones, none)[0] > 0.5
    assert costs(rows, "armchair", tones, none)[1] == 0
    assert costs(rows, "plant", tones, none).tolist() == [0, 0]
    assert stated_colors("a navy-blue sofa") == (*stated_colors("navy"), *stated_colors("blue"))
    assert stated_colors("set_chair") == ()


def test_an_index_of_another_version_is_refused_and_made_anew(tmp_path, monkeypatch):
    painted(tmp_path / "models", "armchair", (200, 30, 30))
    done = index([tmp_path / "models"], tmp_path / "lib.parquet")
    records = read_library(done.file).records
    monkeypatch.setattr(table, "VERSION", 3)
    table._read.cache_clear()
    with pytest.raises(ValueError, match="version 2 of an index of assets, allowed: 3; index the folder again"):
        read_library(done.file)
    assert index([tmp_path / "models"], done.file).read == 1
    assert read_library(done.file).records == records
