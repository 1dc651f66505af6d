"""Style groups of a graph, and which of their objects can share one asset."""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence

import numpy as np

from echomodel.triangles import linked
from echomodel.vocabulary import RoomStyle, vocabulary
from echousd.graph import SceneGraph
from echousd.naming import free_name

ALIKE = 0.15  # largest relative difference of an extent that may be the same piece of furniture
EQUAL = 1e-3  # largest relative difference of an extent within one asset
ROOM_STYLE = "room"
IN_SETS = ("at", "head", "company")  # how pieces stand that are bought as a set: 98 % of real ones are one model


def style_groups(graph: SceneGraph) -> dict[str, str]:
    """Object name -> name of its style; objects that share a `style`, or that a relation unites, are one group.

    Pieces that come in sets, the chairs of a table, the nightstands of a bed, two beds or desks, are one group with
    those of their kind that state a style, unless two styles are stated. A group without a name is called
    `set_<its first object>`. Objects of no group have the style `room`, so that a room looks of one piece.
    """
    place = {node.name: number for number, node in enumerate(graph.nodes)}
    alike: list[tuple[int, int]] = []
    by_style: dict[str, int] = {}
    for number, node in enumerate(graph.nodes):
        if node.style:
            alike.append((number, by_style.setdefault(node.style, number)))
    for relation in graph.relations:
        if "style" in vocabulary().predicate(relation.predicate).unites:
            alike.append((place[relation.subject], place[relation.object]))
    alike += _rows(graph, linked(alike, len(place)).tolist())
    alike += _sets(graph, linked(alike, len(place)).tolist())
    group_of = linked(alike, len(place)).tolist()
    members: dict[int, list[str]] = {}
    for node, number in zip(graph.nodes, group_of, strict=True):
        members.setdefault(number, []).append(node.name)
    style_of = {node.name: node.style for node in graph.nodes}
    out: dict[str, str] = {}
    for group in members.values():
        named = next((style_of[name] for name in group if style_of[name]), None)
        out.update(dict.fromkeys(group, named or (f"set_{group[0]}" if len(group) > 1 else ROOM_STYLE)))
    return {node.name: out[node.name] for node in graph.nodes}


def stated_styles(graph: SceneGraph) -> dict[str, RoomStyle | None]:
    """Object name -> the style of the vocabulary that its group is called by, else that of the room, else None."""
    known = vocabulary().known_style
    return {name: known(group) or known(graph.room.style) for name, group in style_groups(graph).items()}


def _rows(graph: SceneGraph, group_of: Sequence[int]) -> list[tuple[int, int]]:
    """Pairs of lamps without a style that are told to hang above the same piece, in a row; none of two told styles."""
    place = {node.name: number for number, node in enumerate(graph.nodes)}
    stated = {group_of[number] for number, node in enumerate(graph.nodes) if node.style}
    rows: dict[tuple[str, str], list[int]] = {}
    for relation in graph.relations:
        number = place[relation.subject]
        lamp = graph.nodes[number]
        if relation.predicate == "above" and not lamp.style and vocabulary().category(lamp.category).role == "light":
            rows.setdefault((lamp.category, relation.object), []).append(number)
    one = [row for row in rows.values() if len(stated & {group_of[number] for number in row}) < 2]
    return [(number, row[0]) for row in one for number in row]


def _sets(graph: SceneGraph, group_of: Sequence[int]) -> list[tuple[int, int]]:
    """Pairs of objects of one set that no style parts: those without a style join the others of their category."""
    related = {name for relation in graph.relations for name in (relation.subject, relation.object)
            if "style" in vocabulary().predicate(relation.predicate).unites}  # fmt: skip
    kinds: dict[str, list[int]] = {}
    styled: dict[str, set[int]] = {}
    for number, node in enumerate(graph.nodes):
        row = vocabulary().category(node.category)
        if row.stands not in IN_SETS and row.role != "bed" and not (row.role == "board" and row.access):
            continue
        if node.style or node.name in related:
            styled.setdefault(row.name, set()).add(group_of[number])
        kinds.setdefault(row.name, []).append(number)
    pairs = []
    for word, numbers in kinds.items():
        groups = styled.get(word, set())
        if len(groups) < 2:
            first = next((k for k in numbers if group_of[k] in groups), numbers[0])
            pairs += [(k, first) for k in numbers if k != first]
    return pairs


def equal_sizes(
    names: Sequence[str], categories: Sequence[str], styles: Mapping[str, str], size: np.ndarray, free: np.ndarray,
    unequal: Collection[tuple[int, int]] = (),
) -> np.ndarray:  # fmt: skip
    """(n, 3) sizes in which objects of one category and one style group are exactly alike.

    Those that are nearly alike get the smallest extents among them, very different ones the smallest piece's, and those
    of a set whose size is given that size. Lamps of the ceiling hang as low as the lowest of them.

    `names`, `categories`: n words each. `styles`: object name -> style, see `style_groups`. `size`: (n, 3) float,
    metres. `free`: (n,) bool, sizes that may change. `unequal`: pairs (i, j), i < j, that the graph tells to differ in
    size.
    """
    out = np.array(size, float)
    apart = set(unequal)
    left = [i for i in range(len(names)) if styles[names[i]] != ROOM_STYLE]
    while left:
        first = left[0]
        group: list[int] = []
        for i in left:
            alike = categories[i] == categories[first] and styles[names[i]] == styles[names[first]]
            if alike and not any((j, i) in apart for j in group):
                group.append(i)
        left = [i for i in left if i not in group]
        fixed = [i for i in group if not free[i]]
        if fixed:
            for i in set(group) - set(fixed):
                out[i] = size[fixed[int(np.abs(np.log(size[fixed] / size[i])).sum(1).argmin())]]
        elif (size[group].max(0) / size[group].min(0) - 1).max() <= ALIKE:
            out[group] = size[group].min(0)  # fits wherever one of them does
        else:
            out[group] = size[group[int(size[group].prod(1).argmin())]]
        if not fixed and vocabulary().category(categories[first]).support == "ceiling":
            out[group, 1] = size[group, 1].max()  # the one that has to reach down furthest
    return out


def unequal_pairs(graph: SceneGraph) -> set[tuple[int, int]]:
    """Pairs (i, j), i < j, of objects that a relation of the graph tells to differ in size."""
    place = {node.name: number for number, node in enumerate(graph.nodes)}
    words = vocabulary()
    sized = (relation for relation in graph.relations if words.predicate(relation.predicate).measures == "size")
    return {tuple(sorted((place[r.subject], place[r.object]))) for r in sized}  # type: ignore[misc]


def shared_assets(
    names: Sequence[str], categories: Sequence[str], styles: Mapping[str, str], size: np.ndarray
) -> dict[str, str]:
    """Object name -> name of the object whose asset it uses (itself if nothing agrees).

    Objects agree when they have one category and one style group, and their sizes are equal (`equal_sizes`): what is
    told alike is alike, whatever the model draws for each of them.

    `names`, `categories`: n words each. `styles`: object name -> style, see `style_groups`. `size`: (n, 3) float,
    metres.
    """

    def same(i: int, j: int) -> bool:
        agree = categories[i] == categories[j] and styles[names[i]] == styles[names[j]] != ROOM_STYLE
        return agree and bool(np.abs(size[i] / size[j] - 1).max() <= EQUAL)

    return {names[i]: names[j] for i, j in first_alike(range(len(names)), same).items()}


def first_alike(rows: Iterable[int], same: Callable[[int, int], bool]) -> dict[int, int]:
    """Row -> the first of the rows that are no copies which it is the `same` as, itself if there is none."""
    first: dict[int, int] = {}
    for i in rows:
        first[i] = next((j for j in first if first[j] == j and same(i, j)), i)
    return first


def asset_names(owners: Mapping[str, str], categories: Mapping[str, str]) -> dict[str, str]:
    """Object name -> name of its asset: the object's own, or its category's where several objects share the asset.

    A shared asset must not carry the name of one of its users, which other software shows under all of them.

    `owners`: object name -> object whose asset it uses, see `shared_assets`. `categories`: object name -> category.
    """
    taken = set(owners)
    named: dict[str, str] = {}
    for owner in owners.values():
        if owner not in named and sum(other == owner for other in owners.values()) > 1:
            named[owner] = free_name(categories[owner], taken)
            taken.add(named[owner])
    return {name: named.get(owner, owner) for name, owner in owners.items()}
