"""Labelling: the relations that hold in a room, found by the same rules that check them."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from echomodel.graph import ordered_pairs
from echomodel.roomboxes import RoomBoxes
from echomodel.rules.geometry import Spread, pairs
from echomodel.rules.margins import fronts
from echomodel.rules.sets import RuleSet, rule_set
from echomodel.vocabulary import vocabulary

# A label must survive the rounding of its boxes to float32 and to a tenth of a millimetre.
SLACK = 3e-4


def label_relations(room: RoomBoxes, **how: Any) -> np.ndarray:
    """What `label_rooms` finds in one room."""
    return label_rooms([room], **how)[0]


def label_rooms(
    rooms: Sequence[RoomBoxes], *, rules: str = "strict", drop: float = 0.0, rng: np.random.Generator | None = None,
    headings: bool = False,
) -> list[np.ndarray]:  # fmt: skip
    """All relations that hold in each room, less a random share.

    Arguments:
        rooms: boxes; relations are in each room's frame, about the centre of its floor's bounding box.
        rules: `strict` or `sgfront`.
        drop: probability with which each directed edge is left out (SG-FRONT itself shows about half of them).
        rng: source of the dropping; needed where drop > 0.
        headings: `symmetrical_to` asks how furniture with a front is turned, too (rooms to learn from go by places).

    Returns (E, 3) int64 [subject, predicate id, object] for each, sorted by subject, object, predicate.
    Raises ValueError for unknown rules, a drop outside 0..1, or drop > 0 without rng.
    """
    chosen = rule_set(rules)
    if not 0.0 <= drop <= 1.0:
        raise ValueError(f"drop is {drop}: allowed is a probability, 0 to 1")
    if drop > 0.0 and rng is None:
        raise ValueError("drop > 0 needs rng, a numpy random generator")
    starts = np.concatenate([[0], np.cumsum([len(room) for room in rooms])])
    found = _label(rooms, starts, chosen, headings)
    owner = np.searchsorted(starts, found[:, 0], side="right") - 1
    found -= np.stack([starts[owner], np.zeros_like(owner), starts[owner]], -1)
    out = []
    for number in range(len(rooms)):
        edges = found[owner == number]
        if drop > 0.0 and rng is not None:
            edges = edges[rng.random(len(edges)) >= drop]
        out.append(edges)
    return out


def _label(rooms: Sequence[RoomBoxes], starts: np.ndarray, rules: RuleSet, headings: bool) -> np.ndarray:
    subject, object_, _ = ordered_pairs(np.diff(starts))
    if not len(subject):
        return np.zeros((0, 3), np.int64)
    size, position, yaw = (
        np.concatenate([np.asarray(of, float) for of in every])
        for every in zip(*((room.size, room.position, room.yaw) for room in rooms), strict=True)
    )
    centre = np.repeat([room.centre for room in rooms], np.diff(starts), axis=0)
    headed = fronts(word for room in rooms for word in room.categories) if headings else None
    pair = pairs(Spread(size, position, yaw), subject, object_, centre, oriented=rules.oriented, fronts=headed)
    same_category, same = _likeness(rooms, subject, object_)
    columns = {predicate: rule(pair) >= SLACK for predicate, rule in rules.labels.items()}
    for predicate in rules.same_category & columns.keys():
        columns[predicate] &= same_category
    columns.update(same)
    kept = [
        np.stack([subject[mask], np.full(int(mask.sum()), predicate), object_[mask]], -1)
        for predicate, mask in columns.items()
    ]
    edges = np.concatenate(kept).astype(np.int64)
    return edges[np.lexsort((edges[:, 1], edges[:, 2], edges[:, 0]))]


def _likeness(
    rooms: Sequence[RoomBoxes], subject: np.ndarray, object_: np.ndarray
) -> tuple[np.ndarray, dict[int, np.ndarray]]:
    """Whether two objects share their category, and the relations that follow from style, class and model.

    Same style: the same style group, or the same model. Same super category: the same coarse class. Same material: the
    same model, or pieces of one coarse class from one style group.
    """
    category = np.array([_word(word, coarse=False) for room in rooms for word in room.categories], dtype=object)
    coarse = np.array([_word(word, coarse=True) for room in rooms for word in room.categories], dtype=object)
    style = np.array([s for room in rooms for s in (room.styles or (-1,) * len(room))])
    model = np.array([m for room in rooms for m in (room.models or ("",) * len(room))], dtype=object)
    same_model = (model[subject] == model[object_]) & (model[subject] != "")
    same_group = (style[subject] == style[object_]) & (style[subject] >= 0)
    same_coarse = coarse[subject] == coarse[object_]
    of = vocabulary().predicate_id
    return category[subject] == category[object_], {
        of("same_style_as"): same_group | same_model,
        of("same_super_category_as"): same_coarse,
        of("same_material_as"): same_model | (same_group & same_coarse),
    }


def _word(word: str, *, coarse: bool) -> str:
    """The vocabulary's word for a category of any source; words it does not hold stand for themselves."""
    row = vocabulary().known_category(word)
    return word if row is None else row.coarse if coarse else row.name
