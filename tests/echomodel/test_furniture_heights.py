"""Heights that bodies ask for, measured on meshes of the sizes that rooms have.

`python tests/echomodel/test_furniture_heights.py 400` prints the ranges over so many pieces of each kind.
"""

import sys

import numpy as np
import pytest

from echomodel.furniture import draw_choices, draw_style, mesh_of, sample_size, solids
from echomodel.objective.sizes import usual_sizes
from echomodel.vocabulary import vocabulary

PIECES = 16
SEATS = {  # metres: heights of seats, of whole chairs; who works rolls higher, who lounges sits lower
    "dining_chair": ((0.42, 0.48), (0.78, 0.95)),
    "chair": ((0.42, 0.48), (0.78, 0.95)),
    "chinese_chair": ((0.42, 0.48), (0.78, 0.95)),
    "dressing_chair": ((0.42, 0.48), (0.62, 0.85)),
    "office_chair": ((0.42, 0.48), (0.84, 1.15)),
    "armchair": ((0.42, 0.48), (0.7, 1.05)),
    "garden_chair": ((0.42, 0.48), (0.78, 1.02)),
    "stool": ((0.42, 0.48), (0.42, 0.48)),
    "bench": ((0.42, 0.48), (0.42, 0.48)),
    "lounge_chair": ((0.35, 0.42), (0.65, 1.0)),
}
TABLES = {"dining_table": 0.5, "desk": 0.5, "dressing_table": 0.5, "garden_table": 0.4}  # metres between knees and legs
LAMPS = {"pendant_lamp": (0.25, 0.7)}
FEET, LAP, REACH = 0.2, 0.6, 0.25  # metres: knees are above feet and below the lap, so deep under an edge
ROUNDING = 2e-3


def piece(category, seed):
    """A mesh of a kind, in a style and a size of their own, as a room would have it."""
    rng = np.random.default_rng([seed, 7])
    style = draw_style(rng)
    drawn = sample_size(category, rng, style)[None]
    size = usual_sizes([category], drawn, lenient=np.zeros((1, 3), bool))[0]
    made = solids(category, style, draw_choices(rng), size)
    return mesh_of(made, size, round=vocabulary().category(category).round)


def seat_height(mesh):
    """The median height of what is met from above over the front half of a chair, between its arms."""
    low, high = mesh.bounds
    wide, deep, middle = high[0] - low[0], high[2] - low[2], (high[2] + low[2]) / 2
    above = [
        (x, 3.0, middle + z) for x in np.linspace(-0.12, 0.12, 3) * wide for z in np.linspace(0.05, 0.25, 3) * deep
    ]
    points, rays, _ = mesh.ray.intersects_location(np.array(above), np.tile([0, -1.0, 0], (len(above), 1)))
    return float(np.median([points[rays == ray, 1].max() for ray in np.unique(rays)]))


def knee_room(mesh):
    """Metres along the front edge of a table in which nothing stands between feet and lap, the widest such stretch."""
    low, high = mesh.bounds
    step, places = 0.02, np.arange(low[0] + 0.01, high[0], 0.02)
    below = np.array([(x, FEET, high[2] - back) for x in places for back in np.linspace(0.06, REACH, 4)])
    points, rays, _ = mesh.ray.intersects_location(below, np.tile([0, 1.0, 0], (len(below), 1)))
    heights = np.full(len(below), np.inf)
    np.minimum.at(heights, rays, points[:, 1])
    widest = run = 0
    for clear in heights.reshape(-1, 4).min(1) >= LAP:
        run = run + 1 if clear else 0
        widest = max(widest, run)
    return widest * step


def within(values, limits):
    return [round(float(v), 3) for v in values if not limits[0] - ROUNDING <= v <= limits[1] + ROUNDING]


@pytest.mark.parametrize("category", SEATS)
def test_people_can_sit_on_it(category):
    meshes = [piece(category, seed) for seed in range(PIECES)]
    seats, whole = SEATS[category]
    assert within([seat_height(mesh) for mesh in meshes], seats) == []
    assert within([mesh.bounds[1][1] for mesh in meshes], whole) == []


@pytest.mark.parametrize("category", TABLES)
def test_knees_have_room_below_it(category):
    assert within([knee_room(piece(category, seed)) for seed in range(PIECES)], (TABLES[category], np.inf)) == []


@pytest.mark.parametrize("category", LAMPS)
def test_lamps_are_as_wide_as_real_ones(category):
    wide = [max(np.ptp(piece(category, seed).bounds, axis=0)[[0, 2]]) for seed in range(PIECES)]
    assert within(wide, LAMPS[category]) == []


def test_a_seat_and_a_table_of_other_heights_are_found():
    """The measures see what they are for: a chair as high as a bar's, a chest in the place of a table."""
    raised = piece("dining_chair", 1)
    raised.apply_translation([0, 0.25, 0])
    assert seat_height(raised) > 0.65
    assert knee_room(piece("dresser", 1)) < 0.1


if __name__ == "__main__":
    for word in (*SEATS, *TABLES, *LAMPS):
        meshes = [piece(word, seed) for seed in range(int(sys.argv[1]))]
        if word in SEATS:
            measures = {"seat": ([seat_height(m) for m in meshes], SEATS[word][0]),
                        "high": ([m.bounds[1][1] for m in meshes], SEATS[word][1])}  # fmt: skip
        elif word in TABLES:
            measures = {"knees": ([knee_room(m) for m in meshes], (TABLES[word], np.inf))}
        else:
            measures = {"wide": ([max(np.ptp(m.bounds, axis=0)[[0, 2]]) for m in meshes], LAMPS[word])}
        for name, (values, limits) in measures.items():
            out = within(values, limits)
            sys.stdout.write(
                f"{word:15} {name:6} {min(values):.3f} to {max(values):.3f} m, {len(out)} of {len(values)} outside\n"
            )
