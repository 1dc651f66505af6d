"""Two sets of rooms beside each other: can they be told apart, does one cover the other, do they hold the same."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import chain

import numpy as np
import torch
from scipy.optimize import linear_sum_assignment
from scipy.spatial.distance import pdist, squareform
from scipy.stats import entropy, ks_2samp

from echomodel.compact.layout import measurable, seen_from, wall_features
from echomodel.metrics.pointsets import compared
from echomodel.metrics.statistics import Figure, spread
from echomodel.roomboxes import RoomBoxes
from echomodel.sizes import size_score
from echomodel.surroundings import centred
from echomodel.vocabulary import vocabulary

COMPONENTS = 12  # principal components of the reference that layout features are told in
SUBSETS, PART = 60, 0.8  # random parts of both sets that give a figure its interval
FOLDS, TREES, LEAF = 4, 150, 3
AXES = ("width", "height", "depth")
SCORES = 3.0  # standard scores beyond which a size is told no further
WORDS = 2  # the last columns of what is measured of an object are words


def object_features(room: RoomBoxes) -> np.ndarray:
    """(n, F) float: gaps to walls, headings, size, height, the nearest neighbour; last the words of both.

    Boxes are rounded to a centimetre and a degree first: rooms are judged, not how many digits their files have.
    """
    room = replace(
        room, size=np.maximum(np.round(room.size, 2), 0.01), position=np.round(room.position, 2),
        yaw=np.radians(np.round(np.degrees(room.yaw)) % 360),
    )  # fmt: skip
    boxes = measurable(room.boxes())
    floor = torch.from_numpy(centred(room.floor_polygon if len(room.floor_polygon) else None)).expand(len(room), -1, -1)
    sizes = [size_score(word, room.size[k : k + 1])[0] for k, word in enumerate(room.categories)]
    lift = torch.tanh(5 * boxes.position[:, 1:2])
    apart = torch.cdist(boxes.position[:, [0, 2]], boxes.position[:, [0, 2]]).fill_diagonal_(torch.inf)
    here, near = torch.arange(len(boxes)), apart.argmin(1)
    turn = (boxes.yaw[near] - boxes.yaw)[:, None]
    words = torch.tensor([vocabulary().category_id(word) for word in room.categories])
    scores = torch.from_numpy(np.array(sizes)).float().clamp(-SCORES, SCORES)
    columns = [
        wall_features(boxes, floor), scores, lift, seen_from(boxes, here, near), turn.sin(), turn.cos(),
        words[:, None], words[near][:, None],
    ]  # fmt: skip
    return torch.cat([column.float() for column in columns], 1).numpy()


def layout_features(rooms: Sequence[RoomBoxes], reference: Sequence[RoomBoxes]) -> tuple[np.ndarray, np.ndarray]:
    """(A, D) and (B, D) float: means and spreads over each room's objects, in principal components of the reference."""
    from sklearn.decomposition import PCA
    from sklearn.preprocessing import StandardScaler

    measured = [[object_features(room)[:, :-WORDS] for room in part] for part in (rooms, reference)]
    tables = [np.array([np.concatenate([one.mean(0), one.std(0)]) for one in part]) for part in measured]
    scaler = StandardScaler().fit(tables[1])
    ours, theirs = (np.clip(scaler.transform(table), -10, 10) for table in tables)
    found = PCA(min(COMPONENTS, len(theirs) - 1), svd_solver="full").fit(theirs)
    return found.transform(ours), found.transform(theirs)


def set_figures(rooms: Sequence[RoomBoxes], reference: Sequence[RoomBoxes], seed: int) -> dict[str, Figure]:
    """Scene-level 1-NNA, COV and MMD, the Frechet and the kernel distance on layout features, and category KL.

    Intervals are those of `SUBSETS` random parts of both sets, `PART` of each.
    """
    ours, theirs = layout_features(rooms, reference)
    words = [[list(room.categories) for room in part] for part in (rooms, reference)]

    def measured(i: np.ndarray, j: np.ndarray) -> dict[str, float]:
        return neighbours(ours[i], theirs[j]) | {
            "Frechet on layout features": frechet_distance(ours[i], theirs[j]),
            "kernel on layout features": kernel_distance(ours[i], theirs[j]),
            "category KL": category_divergence([words[0][k] for k in i], [words[1][k] for k in j]),
        }

    return with_subsets(measured, len(rooms), len(reference), seed)


def with_subsets(
    measured: Callable[[np.ndarray, np.ndarray], dict[str, float]], first: int, second: int, seed: int
) -> dict[str, Figure]:
    """What is measured of two whole sets, with the interval of their random parts."""
    rng = np.random.default_rng([seed, 4])
    parts = [
        measured(*(np.sort(rng.permutation(count)[: max(2, round(PART * count))]) for count in (first, second)))
        for _ in range(SUBSETS)
    ]
    whole = measured(np.arange(first), np.arange(second))
    return {name: spread(value, [part[name] for part in parts], first) for name, value in whole.items()}


def neighbours(ours: np.ndarray, theirs: np.ndarray) -> dict[str, float]:
    """1-NNA (0.5 is best), COV and MMD of two sets of vectors, (A, D) and (B, D) cut to the smaller number."""
    count = min(len(ours), len(theirs))
    apart = squareform(pdist(np.concatenate([theirs[:count], ours[:count]])))
    found = compared(torch.from_numpy(apart), count)
    return {"1-NNA": found["acc"], "COV": found["cov"], "MMD": found["mmd"]}


def frechet_distance(first: np.ndarray, second: np.ndarray) -> float:
    """|m1 - m2|^2 + tr(C1 + C2 - 2 (C1 C2)^(1/2)) of (A, D) and (B, D) (Heusel et al. 2017); features as they are."""
    means = [part.mean(0) for part in (first, second)]
    pairs = zip((first, second), means, strict=True)
    a, b = (np.asarray(np.linalg.qr((part - m) / np.sqrt(len(part) - 1), mode="r")) for part, m in pairs)
    root = np.linalg.svd(a @ b.T, compute_uv=False).sum()  # C1 = a'a, C2 = b'b: the trace of the square root
    return float(((means[0] - means[1]) ** 2).sum() + (a**2).sum() + (b**2).sum() - 2 * root)


def kernel_distance(first: np.ndarray, second: np.ndarray) -> float:
    """Unbiased squared MMD with the kernel (x.y / D + 1)^3 of (A, D) and (B, D) (Binkowski et al. 2018)."""
    from sklearn.metrics.pairwise import polynomial_kernel

    def within(x: np.ndarray) -> float:
        kernel = polynomial_kernel(x)
        return float((kernel.sum() - np.trace(kernel)) / (len(x) * (len(x) - 1)))

    return within(first) + within(second) - 2 * float(polynomial_kernel(first, second).mean())


def category_divergence(rooms: Sequence[Sequence[str]], reference: Sequence[Sequence[str]]) -> float:
    """KL divergence of the categories of the reference from those of the rooms, nats; half a piece added of each."""
    ours, theirs = (Counter(chain.from_iterable(part)) for part in (rooms, reference))
    words = sorted({*ours, *theirs})
    return float(entropy(*([count[word] + 0.5 for word in words] for count in (theirs, ours))))


def forest_auc(made: Sequence[RoomBoxes], real: Sequence[RoomBoxes], seed: int, *, paired: bool = False) -> Figure:
    """Area under the curve of a random forest that tells made rooms from real ones, by their objects; 0.5 = it cannot.

    It judges rooms that it was not trained on; a room's score is the mean over its objects. Fewer rooms than there are
    folds of them are not told apart: no value.

    `paired`: the n-th of both are the same furniture, and judged by the same fold.
    """
    from sklearn.ensemble import RandomForestClassifier
    from sklearn.model_selection import GroupKFold, cross_val_predict

    if min(len(made), len(real)) < FOLDS:
        return Figure(None)
    rooms = [*made, *real]
    tables = [object_features(room) for room in rooms]
    x, room = np.concatenate(tables), np.repeat(np.arange(len(rooms)), [len(table) for table in tables])
    truth = np.arange(len(rooms)) < len(made)
    group = np.where(truth, np.arange(len(rooms)), np.arange(len(rooms)) - (len(made) if paired else 0))[room]
    forest = RandomForestClassifier(TREES, min_samples_leaf=LEAF, class_weight="balanced", random_state=seed)
    folds = {"groups": group, "cv": GroupKFold(FOLDS), "method": "predict_proba"}
    odds = cross_val_predict(forest, x, truth[room], **folds)[:, 1]
    score = np.bincount(room, odds) / np.bincount(room)
    higher = (1 + np.sign(score[truth] - score[~truth, None])) / 2  # (real, made); half where they are equal
    rng = np.random.default_rng([seed, 6])
    drawn = [np.ix_(*(rng.choice(count, count) for count in higher.shape)) for _ in range(200)]
    return spread(float(higher.mean()), [higher[rows].mean() for rows in drawn], len(made))


def size_scores(rooms: Sequence[RoomBoxes]) -> np.ndarray:
    """(n, 3) standard scores of width, height and depth within the classes, to a thousandth."""
    rows = [size_score(w, room.size[k : k + 1]) for room in rooms for k, w in enumerate(room.categories)]
    return np.round(np.concatenate(rows), 3)


def size_distances(rooms: Sequence[RoomBoxes], reference: Sequence[RoomBoxes]) -> dict[str, float]:
    """Kolmogorov-Smirnov distances of `size_scores`, axis by axis."""
    pairs = zip(AXES, size_scores(rooms).T, size_scores(reference).T, strict=True)
    return {name: float(ks_2samp(ours, theirs, method="asymp").statistic) for name, ours, theirs in pairs}


def layout_distance(one: RoomBoxes, other: RoomBoxes) -> float:
    """Mean distance in plan between the pieces of two layouts of the same furniture, metres; equal pieces may swap."""
    words, total = np.array(one.categories, dtype=object), 0.0
    for word in set(one.categories):
        a, b = (room.position[words == word][:, [0, 2]] for room in (one, other))
        apart = np.linalg.norm(a[:, None] - b[None], axis=-1)
        total += float(apart[linear_sum_assignment(apart)].sum())
    return total / max(len(one), 1)
