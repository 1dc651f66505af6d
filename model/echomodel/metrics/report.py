"""A set of rooms beside the real ones, figure by figure, with a distance."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from echomodel.metrics.room_figures import room_figures
from echomodel.metrics.tasks import with_known_words
from echomodel.roomboxes import RoomBoxes
from echomodel.rooms.statistics import room_statistics

LEAST = 25  # figures of fewer real or generated samples say little and are left out


@dataclass(frozen=True)
class Row:
    """One figure: what it is, here and in real rooms, and how far the two are apart.

    Arguments:
        distance: for shares their difference; for percentiles the mean difference, over the range of the real ones.
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
