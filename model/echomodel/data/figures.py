"""Figures of a set of rooms (counts, sizes, walls, pairs, relations, overlaps), and two sets beside each other.

Figures come in the form of `echomodel/data/room_statistics.json`, so that any set stands beside the real rooms.
"""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from echomodel.boxes2d import axes
from echomodel.data.roomset import with_known_words
from echomodel.roomboxes import RoomBoxes, footprints
from echomodel.rooms.statistics import room_statistics
from echomodel.rules import label_rooms
from echomodel.vocabulary import vocabulary

FIVE, THREE, QUARTERS = (5, 25, 50, 75, 95), (5, 50, 95), (25, 50, 75)
LEAST = 25  # figures of fewer real or generated samples say little and are left out


def room_figures(rooms: Sequence[RoomBoxes]) -> dict:
    """All figures of rooms in the vocabulary's words (see `with_known_words`).

    Returns `rooms` (per type), `sizes`, `walls` (per class), `pairs`, `relations`, `overlap`: percentiles in metres,
    shares 0 to 1, in the form of `room_statistics.json`.
    """
    return {
        "rooms": {kind: _type_figures(group) for kind, group in _by_type(rooms).items()},
        "sizes": _sizes(rooms),
        "walls": _walls(rooms),
        "pairs": _pairs(rooms),
        "relations": _relations(rooms),
        "overlap": _overlap(rooms),
    }


def _by_type(rooms: Iterable[RoomBoxes]) -> dict[str, list[RoomBoxes]]:
    groups: dict[str, list[RoomBoxes]] = defaultdict(list)
    for room in rooms:
        groups[room.room_type].append(room)
    return groups


def _type_figures(rooms: list[RoomBoxes]) -> dict:
    from shapely import Polygon

    extents = np.sort([np.ptp(room.floor_polygon, axis=0) for room in rooms], axis=-1)
    counts = [Counter(room.categories) for room in rooms]
    area = np.array([Polygon(room.floor_polygon).area for room in rooms])
    number = np.array([len(room) for room in rooms])
    presence = {}
    for category in sorted({c for count in counts for c in count}):
        held = [count[category] for count in counts if count[category]]
        tally = {str(k): v for k, v in sorted(Counter(held).items())}
        presence[category] = {"share": len(held) / len(rooms), "counts": tally}
    return {
        "rooms": len(rooms),
        "area": _percentiles(area, FIVE),
        "short": _percentiles(extents[:, 0], FIVE),
        "long": _percentiles(extents[:, 1], FIVE),
        "objects": _percentiles(number, FIVE),
        "rectangular": float(np.mean([len(room.floor_polygon) == 4 for room in rooms])),
        "height": _percentiles([room.height for room in rooms], FIVE),
        "area_count_correlation": float(np.corrcoef(area, number)[0, 1]) if len(rooms) > 2 else 0.0,
        "presence": presence,
    }


def _sizes(rooms: Iterable[RoomBoxes]) -> dict:
    boxes: dict[str, list[np.ndarray]] = defaultdict(list)
    for room in rooms:
        for k, category in enumerate(room.categories):
            boxes[category].append(np.append(room.size[k], room.position[k, 1]))
    out = {}
    for category, rows in boxes.items():
        table = np.percentile(rows, THREE, axis=0)
        out[category] = {
            "n": len(rows),
            **{name: table[i, :3].tolist() for i, name in enumerate(("p5", "median", "p95"))},
            "mount": table[:, 3].tolist(),
        }
    return out


def ray_lengths(polygon: np.ndarray, origin: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Distance from points to the first wall met in their directions.

    Arguments:
        polygon: (k, 2) float, x and z of the corners.
        origin: (n, 2) float. direction: (n, 2) float, unit vectors.

    Returns (n,) float, infinity where no wall is met.
    """
    start, side = polygon, np.roll(polygon, -1, axis=0) - polygon
    with np.errstate(divide="ignore", invalid="ignore"):
        across = direction[:, None, 0] * side[None, :, 1] - direction[:, None, 1] * side[None, :, 0]
        gap = start[None] - origin[:, None]
        length = (gap[..., 0] * side[None, :, 1] - gap[..., 1] * side[None, :, 0]) / across
        along = (gap[..., 0] * direction[:, None, 1] - gap[..., 1] * direction[:, None, 0]) / across
        met = (np.abs(across) > 1e-9) & (length >= 0) & (along >= -1e-9) & (along <= 1 + 1e-9)
    return np.where(met, length, np.inf).min(-1)


def _walls(rooms: Iterable[RoomBoxes]) -> dict:
    rows: dict[str, list[tuple[float, ...]]] = defaultdict(list)
    for room in rooms:
        if not len(room):
            continue
        right, front = axes(room.yaw)
        plan = room.position[:, [0, 2]]
        reach = [ray_lengths(room.floor_polygon, plan, d) for d in (-front, right, -right, front)]
        back = reach[0] - room.size[:, 2] / 2
        side = np.minimum(reach[1], reach[2]) - room.size[:, 0] / 2
        askew = np.abs((room.yaw + math.pi / 4) % (math.pi / 2) - math.pi / 4)
        for k, category in enumerate(room.categories):
            if vocabulary().category(category).support != "ceiling" and np.isfinite(back[k]):
                centre = min(length[k] for length in reach)
                rows[category].append((back[k], side[k], askew[k], centre))
    out = {}
    for category, values in rows.items():
        back, side, askew, centre = np.array(values).T
        out[category] = {
            "n": len(back),
            "back_gap": _percentiles(back, QUARTERS),
            "back": float((back < 0.15).mean()),
            "side": float((side < 0.15).mean()),
            "axis_aligned": float((askew < math.radians(5)).mean()),
            "centre_wall": _percentiles(centre, QUARTERS),
        }
    return out


# The pairs of room_statistics.json: what stands near what.
PAIRS = (
    ("nightstand", "double_bed"), ("dining_chair", "dining_table"), ("coffee_table", "multi_seat_sofa"),
    ("tv_stand", "multi_seat_sofa"), ("tv_stand", "double_bed"), ("side_table", "multi_seat_sofa"),
    ("armchair", "multi_seat_sofa"), ("armchair", "coffee_table"), ("lounge_chair", "coffee_table"),
    ("wardrobe", "double_bed"), ("dressing_table", "double_bed"), ("dining_chair", "desk"),
    ("pendant_lamp", "dining_table"), ("pendant_lamp", "double_bed"), ("pendant_lamp", "coffee_table"),
    ("ottoman", "double_bed"), ("ottoman", "coffee_table"), ("sideboard", "dining_table"),
    ("dining_table", "multi_seat_sofa"), ("floor_lamp", "multi_seat_sofa"), ("plant", "multi_seat_sofa"),
    ("plant", "tv_stand"),
)  # fmt: skip


def _pairs(rooms: Iterable[RoomBoxes]) -> list[dict]:
    rows: dict[tuple[str, str], list[tuple[float, float, float, float, float]]] = {pair: [] for pair in PAIRS}
    for room in rooms:
        present = set(room.categories)
        for child, anchor in PAIRS:
            if child in present and anchor in present:
                rows[child, anchor].extend(_pair_rows(room, child, anchor))
    out = []
    for (child, anchor), values in rows.items():
        if not values:
            continue
        lateral, forward, gap, turn, faces = np.array(values).T
        quarter = np.round(turn / (math.pi / 2)).astype(int) % 4
        spans = {"lateral": np.abs(lateral), "forward": forward, "gap": np.maximum(gap, 0)}
        out.append(
            {"child": child, "anchor": anchor, "n": len(values)}
            | {name: _percentiles(of, FIVE) for name, of in spans.items()}
            | {"near": float((gap < 0.45).mean()), "overlap": float((gap < 0).mean())}
            | {"turn": [float((quarter == k).mean()) for k in range(4)]}
            | {"faces": float((faces < math.radians(30)).mean())}
        )
    return out


def _pair_rows(room: RoomBoxes, child: str, anchor: str) -> list[tuple[float, float, float, float, float]]:
    """Per child and its nearest anchor: lateral, forward (anchor's frame), gap of the hulls, turn, angle off facing."""
    names = np.array(room.categories)
    plan = room.position[:, [0, 2]]
    anchors = np.flatnonzero(names == anchor)
    out = []
    for c in np.flatnonzero(names == child):
        a = anchors[np.argmin(((plan[anchors] - plan[c]) ** 2).sum(-1))]
        dx, dz = plan[c] - plan[a]
        cos, sin = math.cos(room.yaw[a]), math.sin(room.yaw[a])
        lateral, forward = cos * dx - sin * dz, sin * dx + cos * dz
        turn = (room.yaw[c] - room.yaw[a]) % (2 * math.pi)
        tc, ts = abs(math.cos(turn)), abs(math.sin(turn))
        half_x = (tc * room.size[c, 0] + ts * room.size[c, 2]) / 2
        half_z = (ts * room.size[c, 0] + tc * room.size[c, 2]) / 2
        gap_x = abs(lateral) - room.size[a, 0] / 2 - half_x
        gap_z = abs(forward) - room.size[a, 2] / 2 - half_z
        gap = math.hypot(max(gap_x, 0), max(gap_z, 0)) if max(gap_x, gap_z) > 0 else max(gap_x, gap_z)
        towards = math.atan2(-dx, -dz)
        faces = abs((room.yaw[c] - towards + math.pi) % (2 * math.pi) - math.pi)
        out.append((lateral, forward, gap, turn, faces))
    return out


def _relations(rooms: Sequence[RoomBoxes]) -> dict[str, float]:
    """Share of ordered pairs that carry each relation, by the rules of SG-FRONT."""
    pairs = sum(len(room) * (len(room) - 1) for room in rooms)
    ids = np.concatenate([edges[:, 1] for edges in label_rooms(rooms, rules="sgfront")]) if rooms else np.zeros(0, int)
    return {p.name: float((ids == p.id).sum() / max(pairs, 1)) for p in vocabulary().predicates if p.measures}


def _overlap(rooms: Iterable[RoomBoxes]) -> dict[str, float]:
    """Share of pairs on the floor that share more than 0.01 square metres, of objects with over 10% outside."""
    from shapely.geometry import Polygon

    meets = pairs = outside = objects = 0
    for room in rooms:
        floor = Polygon(room.floor_polygon)
        prints = [Polygon(corners) for corners in footprints(np.maximum(room.size, 1e-6), room.position, room.yaw)]
        low = room.position[:, 1] < 0.05
        for i in np.flatnonzero(low):
            objects += 1
            outside += prints[i].difference(floor).area > 0.1 * max(prints[i].area, 1e-9)
            for j in np.flatnonzero(low[:i]):
                pairs += 1
                meets += prints[i].intersection(prints[j]).area > 0.01
    return {"floor_pairs": meets / max(pairs, 1), "outside_floor": outside / max(objects, 1)}


def _percentiles(values: Iterable[float], at: tuple[int, ...]) -> list[float]:
    return np.percentile(np.asarray(values, float), at).tolist()


@dataclass(frozen=True)
class Row:
    """One figure: what it is, here and in real rooms, and how far the two are apart.

    `distance`: for shares their difference; for percentiles the mean difference, over the range of the real ones.
    """

    section: str
    name: str
    ours: tuple[float, ...]
    real: tuple[float, ...]
    distance: float


def compare(rooms: Sequence[RoomBoxes], real: Sequence[RoomBoxes] | None = None) -> list[Row]:
    """All figures of `rooms` beside those of `real` (default: the aggregate statistics of 896 real rooms)."""
    ours = room_figures(with_known_words(rooms))
    other = room_statistics() if real is None else room_figures(with_known_words(real))
    rows = list(rows_between(ours, other))
    # The aggregate statistics count `close by` in a way of their own: by the published rule the figure is not known.
    return rows if real is not None else [row for row in rows if row.name != "close_by"]


def left_out(rooms: Sequence[RoomBoxes], real: Sequence[RoomBoxes] | None = None) -> list[str]:
    """A sentence for every room type that is too rare, here or among the real rooms, to be compared."""
    ours = Counter(room.room_type for room in with_known_words(rooms))
    if real is None:
        theirs = {kind: found["rooms"] for kind, found in room_statistics()["rooms"].items()}
    else:
        theirs = dict(Counter(room.room_type for room in with_known_words(real)))
    return [
        f"{kind}: {ours.get(kind, 0)} here and {theirs.get(kind, 0)} real, compared from {LEAST} of each"
        for kind in sorted({*ours, *theirs})
        if min(ours.get(kind, 0), theirs.get(kind, 0)) < LEAST
    ]


def rows_between(ours: dict, real: dict) -> Iterator[Row]:
    """Rows of two sets of figures (see `room_figures`)."""
    for kind, mine in ours["rooms"].items():
        theirs = real["rooms"].get(kind)
        if theirs is None or min(mine["rooms"], theirs["rooms"]) < LEAST:
            continue
        for name in ("area", "short", "long", "objects", "height"):
            yield _range(f"room {kind}", name, mine[name], theirs[name])
        yield _share(f"room {kind}", "rectangular", mine["rectangular"], theirs["rectangular"])
        for category, entry in theirs["presence"].items():
            got = mine["presence"].get(category, {"share": 0.0, "counts": {}})
            yield _share(f"presence {kind}", category, got["share"], entry["share"])
            if entry["share"] > 0.1 and got["share"] > 0.05:
                a, b = _mean(got["counts"]), _mean(entry["counts"])
                yield Row(f"count {kind}", category, (a,), (b,), abs(a - b) / b)
    for category, theirs in real["sizes"].items():
        got = ours["sizes"].get(category)
        if got is None or min(got["n"], theirs["n"]) < LEAST:
            continue
        for i, axis in enumerate("xyz"):
            yield _range(
                f"size {axis}", category,
                [got[p][i] for p in ("p5", "median", "p95")], [theirs[p][i] for p in ("p5", "median", "p95")],
            )  # fmt: skip
        if theirs["mount"][1] > 0:
            yield _range("mount", category, got["mount"], theirs["mount"])
    for category, theirs in real["walls"].items():
        got = ours["walls"].get(category)
        if got is None or min(got["n"], theirs["n"]) < LEAST:
            continue
        yield _range("wall gap", category, got["back_gap"], theirs["back_gap"], least=0.5)
        for name in ("back", "side", "axis_aligned"):
            yield _share(f"wall {name}", category, got[name], theirs[name])
    mine_pairs = {(p["child"], p["anchor"]): p for p in ours["pairs"]}
    for theirs in real["pairs"]:
        got = mine_pairs.get((theirs["child"], theirs["anchor"]))
        if got is None or min(got["n"], theirs["n"]) < LEAST:
            continue
        name = f"{theirs['child']} ~ {theirs['anchor']}"
        yield _range("pair lateral", name, got["lateral"], theirs["lateral"], least=0.5)
        yield _range("pair forward", name, got["forward"], theirs["forward"], least=0.5)
        yield _share("pair near", name, got["near"], theirs["near"])
        yield _share("pair faces", name, got["faces"], theirs["faces"])
        turn = 0.5 * float(np.abs(np.subtract(got["turn"], theirs["turn"])).sum())
        yield Row("pair turn", name, tuple(got["turn"]), tuple(theirs["turn"]), turn)
    for name, theirs in real["relations"].items():
        yield _share("relation", name, ours["relations"][name], theirs)
    for name, theirs in real["overlap"].items():
        yield _share("overlap", name, ours["overlap"][name], theirs)


def _mean(counts: dict[str, int]) -> float:
    total = sum(counts.values())
    return sum(int(count) * number for count, number in counts.items()) / max(total, 1)


def _range(section: str, name: str, ours: Sequence[float], real: Sequence[float], least: float = 1e-6) -> Row:
    spread = max(real[-1] - real[0], least)
    distance = float(np.mean(np.abs(np.subtract(ours, real)))) / spread
    return Row(section, name, tuple(ours), tuple(real), distance)


def _share(section: str, name: str, ours: float, real: float) -> Row:
    return Row(section, name, (ours,), (real,), abs(ours - real))


def section_means(rows: Sequence[Row]) -> dict[str, float]:
    """Mean distance per kind of figure and over `all`."""
    groups: dict[str, list[float]] = {}
    for row in rows:
        groups.setdefault(row.section.split()[0], []).append(row.distance)
    means = {name: float(np.mean(values)) for name, values in groups.items()}
    return {**means, "all": float(np.mean([row.distance for row in rows]))}
