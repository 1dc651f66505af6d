"""Do the relations of a graph contradict each other? Every message names the relations that do."""

from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from graphlib import CycleError, TopologicalSorter
from itertools import pairwise

from echomodel.vocabulary import vocabulary

Triple = tuple[str, str, str]
MAX_ERRORS = 20  # of one graph that are told


class GraphError(ValueError):
    """A scene graph or a file that holds one is not valid; one line says what was found, where and what is allowed.

    `about` leads to the fault: field names and positions, such as ("relations", 3) or ("nodes", 0, "size"). `others`
    are further faults of the same text; a file's message has a line for each, which `lines` holds one by one.
    """

    def __init__(self, message: str, about: tuple[str | int, ...] = ()) -> None:
        super().__init__(message)
        self.about = about
        self.others: tuple[GraphError, ...] = ()
        self.lines: tuple[str, ...] = (message,)


@contextmanager
def faults_of(file: str) -> Iterator[None]:
    """Every `GraphError` of the block begins with the name of a file; empty = it stays as it is."""
    try:
        yield
    except GraphError as error:
        if not file:
            raise
        located = GraphError(f"{file}: {error}", error.about)
        located.lines = tuple(f"{file}: {line}" for line in error.lines)
        raise located from None


def raise_all(wrong: Sequence[GraphError]) -> None:
    """Raise the first of some faults with the others (`MAX_ERRORS` in all); none, and nothing happens."""
    if wrong:
        wrong[0].others = tuple(wrong[1:MAX_ERRORS])
        raise wrong[0]


def name_faults(named: Sequence[tuple[str, Sequence[str]]]) -> list[GraphError]:
    """The faults of objects, each a name and the two others that it stands between, if any.

    Faults: a name that an object before has, and another that is no object.
    """
    known = {name for name, _ in named}
    seen: set[str] = set()
    wrong = []
    for position, (name, others) in enumerate(named):
        here = ("nodes", position)
        if name in seen:
            wrong.append(GraphError(f"two objects are called {name!r}, allowed: a name of its own for each", here))
        seen.add(name)
        wrong += [
            GraphError(
                f"object {name!r}: between: {other!r} is no object of this graph, allowed: {listed(sorted(known))}",
                (*here, "between"),
            )
            for other in others
            if other not in known
        ]
    return wrong


def triple_faults(triples: Sequence[Triple], names: Iterable[str]) -> list[GraphError]:
    """The faults among `triples`, each (subject, predicate, object) in canonical words.

    Faults: an endpoint that is none of `names`, a self relation, a relation stated twice, and a cycle in one of the
    orders that the vocabulary defines (left and right are one order along the room's z axis, bigger, smaller and `in`
    are one order of volumes ...), of which "A left B, B left A" and "A bigger B, A smaller B" are the shortest cases.
    """
    stated = dict[Triple, int]()
    wrong = unknown_ends(triples, set(names))
    for position, (subject, predicate, object_) in enumerate(triples):
        here = ("relations", position)
        if subject == object_:
            wrong.append(
                GraphError(f"relation '{subject} {predicate} {object_}': an object cannot relate to itself", here)
            )
        elif (subject, predicate, object_) in stated:
            wrong.append(GraphError(f"relation '{subject} {predicate} {object_}' is stated twice", here))
        stated.setdefault((subject, predicate, object_), position)
    for order, edges in ordered_edges(triple for triple in stated if triple[0] != triple[2]).items():
        cycle = find_cycle(edges)
        if cycle:
            steps = [f"'{' '.join(edges[pair])}'" for pair in cycle]
            here = ("relations", max(stated[edges[pair]] for pair in cycle))
            if len(steps) == 2:
                wrong.append(GraphError(f"{steps[0]} contradicts {steps[1]} ({order} order)", here))
                continue
            together = f"{', '.join(steps[:-1])} and {steps[-1]}"
            wrong.append(GraphError(f"{together} contradict each other: a cycle in the {order} order", here))
    return wrong


def unknown_ends(triples: Sequence[Triple | None], known: Collection[str]) -> list[GraphError]:
    """An error for every relation whose subject or object is not among the names `known`; None is passed over."""
    return [
        GraphError(
            f"relation '{' '.join(triple)}': {role} {name!r} is no object of this graph, "
            f"allowed: {listed(sorted(known))}",
            ("relations", position),
        )
        for position, triple in enumerate(triples)
        if triple is not None
        for role, name in (("subject", triple[0]), ("object", triple[2]))
        if name not in known
    ]


def ordered_edges(triples: Iterable[Triple]) -> dict[str, dict[tuple[str, str], Triple]]:
    """Per order of the vocabulary, the pairs (less, more) with the triple that says so."""
    words = vocabulary()
    orders: dict[str, dict[tuple[str, str], Triple]] = defaultdict(dict)
    for subject, predicate, object_ in triples:
        entry = words.predicate(predicate)
        if entry.order:
            pair = (object_, subject) if entry.rank > 0 else (subject, object_)
            orders[entry.order].setdefault(pair, (subject, predicate, object_))
    return orders


def find_cycle(edges: Mapping[tuple[str, str], object]) -> list[tuple[str, str]]:
    """A shortest cycle through a node that lies on one, as its edges in order; empty if there is none."""
    after: dict[str, list[str]] = defaultdict(list)
    for less, more in edges:
        after[less].append(more)
    try:
        TopologicalSorter(after).prepare()
    except CycleError as error:
        import networkx  # graphs without a fault do without

        start = next(node for node in after if node in error.args[1])
        back = networkx.single_target_shortest_path(networkx.DiGraph(list(edges)), start)
        way = [start, *min((back[other] for other in after[start] if other in back), key=len)]
        return list(pairwise(way))
    return []


def listed(words: Sequence[str], most: int = 12) -> str:
    """`a, b, c` and, past `most` words, how many more there are."""
    more = f" and {len(words) - most} more" if len(words) > most else ""
    return ", ".join(words[:most]) + more
