import pytest

from echousd.assets.licences import allowed, spdx
from echousd.assets.naming import category_of, fitted, likely_unit


@pytest.mark.parametrize(
    ("said", "name"),
    [
        ("CC0", "CC0-1.0"),
        ("Public Domain", "CC0-1.0"),
        ("cc-by", "CC-BY-4.0"),
        ("by", "CC-BY-4.0"),
        ("by-nc-sa", "CC-BY-NC-SA-4.0"),
        ("Creative Commons Attribution 3.0 Unported license", "CC-BY-3.0"),
        ("Creative Commons Attribution-NonCommercial 4.0", "CC-BY-NC-4.0"),
        ("Apache-2.0", "Apache-2.0"),
        ("", "unknown"),
        ("all rights reserved", "all rights reserved"),
    ],
)
def test_licences_by_their_spdx_names(said, name):
    assert spdx(said) == name


def test_a_filter_lets_through_what_it_names_and_nothing_more():
    assert allowed("CC-BY-3.0", ["CC0", "CC-BY"])
    assert allowed("CC0-1.0", ["CC0", "CC-BY"])
    assert not allowed("CC-BY-NC-4.0", ["CC0", "CC-BY"])
    assert not allowed("CC-BY-SA-4.0", ["CC-BY"])
    assert not allowed("CC-BY-4.0", ["CC-BY-3.0"])
    assert not allowed("unknown", ["CC0"])


@pytest.mark.parametrize(
    ("labels", "name", "dims", "category"),
    [
        (("bed",), "x", (1.8, 1.0, 2.1), "double_bed"),
        (("wardrobe.n.01",), "x", None, "wardrobe"),
        ((), "Oak Dining Chair 02", (0.5, 0.9, 0.5), "dining_chair"),
        ((), "coffee_table_glass", None, "coffee_table"),
        ((), "billy bookcase white", None, "bookshelf"),
        ((), "table", (1.0, 0.4, 0.6), "coffee_table"),
        ((), "toaster", None, ""),
        ((), "bunkBed90x190", (1.1, 1.8, 2.0), "kids_bed"),
        ((), "Bücherregal", None, "bookshelf"),
        ((), "Couchtisch Eiche", (1.1, 0.4, 0.6), "coffee_table"),
        ((), "table_de_chevet", (0.4, 0.5, 0.4), "nightstand"),
        ((), "Lit 140x190", (1.6, 0.7, 2.0), "double_bed"),
        ((), "mesilla de noche", None, "nightstand"),
        ((), "Divano ad angolo", (2.4, 0.8, 1.7), "l_shaped_sofa"),
        ((), "eetkamerstoel", None, "chair"),
        ((), "Guarda-roupa", None, "wardrobe"),
        ((), "Kühlschrank", None, ""),
        ((), "Küchenschrank", None, ""),
        ((), "Kitchen upper cabinet", None, ""),
    ],
)
def test_words_say_what_a_model_is(labels, name, dims, category):
    assert category_of(labels, name, "", dims)[0] == category


def test_units_of_a_kitchen_are_no_cabinets_but_its_chairs_are_chairs():
    assert category_of((), "Lower cabinet", "Kitchen") == ("", 0.0)
    assert category_of((), "Wine cabinet", "Living room")[0] == "wine_cabinet"
    assert category_of((), "Chair", "Kitchen", (0.45, 0.9, 0.5))[0] == "chair"
    assert fitted("cabinet", "Drawers cabinet", "Kitchen")


@pytest.mark.parametrize(
    ("name", "group"),
    [("Schrank", "Küche"), ("Küchenschrank", ""), ("cabinet_sink_white", ""), ("cabinet", "bath_room"),
     ("washBasin_cabinet", ""), ("Cabinet", "02_Cozinha")],
)  # fmt: skip
def test_units_of_a_kitchen_in_any_spelling(name, group):
    assert fitted("cabinet", name, group)
    assert category_of((), name, group) == ("", 0.0)


def test_confidence_falls_with_the_place_of_the_word_and_with_sizes_that_no_such_thing_has():
    label, name = category_of(("wardrobe",), "x")[1], category_of((), "wardrobe")[1]
    assert label > name > category_of((), "thing", "wardrobe")[1] > 0.5
    assert category_of((), "wardrobe", "", (0.02, 0.03, 0.01))[1] < 0.5
    assert likely_unit("wardrobe", (160, 220, 60)) == 0.01
    assert likely_unit("wardrobe", (0.001, 1, 1)) is None
