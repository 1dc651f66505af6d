"""ADE20K names (the 150 scene-parsing classes) for our categories and for the parts of a room's shell."""

from __future__ import annotations

from echomodel.vocabulary import vocabulary

OF_CATEGORY = {
    "armchair": "armchair",
    "bench": "bench",
    "ceiling_lamp": "light",
    "coffee_table": "coffee table",
    "dresser": "chest of drawers",
    "nightstand": "chest of drawers",
    "office_chair": "swivel chair",
    "ottoman": "ottoman",
    "pendant_lamp": "chandelier",
    "plant": "plant",
    "sideboard": "buffet",
    "stool": "stool",
    "bar_stool": "stool",
    "tv": "television receiver",
    "tv_stand": "cabinet",
    "wall_lamp": "sconce",
    "floor": "floor",
    "wall": "wall",
}
OF_COARSE = {
    "bed": "bed",
    "bookshelf": "bookcase",
    "cabinet": "cabinet",
    "chair": "chair",
    "desk": "desk",
    "lamp": "lamp",
    "shelf": "shelf",
    "sofa": "sofa",
    "table": "table",
    "wardrobe": "wardrobe",
}


def ade20k(category: str) -> str:
    """The ADE20K class of a category of the vocabulary, of `floor` or of `wall`; raises `UnknownWord`."""
    if category in OF_CATEGORY:
        return OF_CATEGORY[category]
    entry = vocabulary().category(category)
    return OF_CATEGORY.get(entry.name) or OF_COARSE[entry.coarse]
