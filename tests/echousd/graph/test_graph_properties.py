"""Properties that hold for every valid graph: text forms are lossless, edits keep graphs valid, cycles are found."""

from __future__ import annotations

import itertools

import networkx
import pytest
from graph_strategies import WORDS, graphs, names
from hypothesis import given, settings
from hypothesis import strategies as st

from echousd.graph import GraphError, Node, SceneGraph
from echousd.graph.consistency import find_cycle, ordered_edges

categories = st.sampled_from([category.name for category in WORDS.categories])
predicates = st.sampled_from([predicate.name for predicate in WORDS.predicates])


def types(graph: SceneGraph) -> list[list[type]]:
    return [[type(value) for value in node.attributes.values()] for node in graph.nodes]


@settings(deadline=None, max_examples=30)
@given(graphs())
def test_text_forms_are_lossless(graph):
    for read, text in (
        (SceneGraph.from_json, graph.to_json()),
        (SceneGraph.from_yaml, graph.to_yaml()),
        (SceneGraph.model_validate_json, graph.model_dump_json()),
    ):
        again = read(text)
        assert again == graph
        assert types(again) == types(graph)
    assert SceneGraph.from_json(graph.to_json()).to_json() == graph.to_json()
    assert SceneGraph.from_yaml(graph.to_yaml()).to_yaml() == graph.to_yaml()


@settings(deadline=None, max_examples=30)
@given(st.data())
def test_edits_give_valid_graphs_or_raise(data):
    graph = data.draw(graphs())
    for _ in range(data.draw(st.integers(1, 6))):
        name = data.draw(st.sampled_from([*graph.names, "nobody"]))
        other = data.draw(st.sampled_from([*graph.names, "nobody"]))
        predicate, word = data.draw(predicates), data.draw(categories)
        edits = {
            "add": lambda g, name=name, word=word: g.add_node(name + "_2", word),
            "remove": lambda g, name=name: g.remove_node(name),
            "rename": lambda g, name=name: g.update_node(name, name=data.draw(names)),
            "relabel": lambda g, name=name, word=word: g.update_node(name, category=word),
            "lock": lambda g, name=name: g.lock(name),
            "relate": lambda g, s=name, p=predicate, o=other: g.relate(s, p, o),
            "unrelate": lambda g, s=name, p=predicate, o=other: g.unrelate(s, p, o),
            "change": lambda g, s=name, p=predicate, o=other: g.unrelate(s, p, o).relate(s, "close_by", o),
        }
        before = graph.to_json()
        try:
            after = edits[data.draw(st.sampled_from(sorted(edits)))](graph)
        except GraphError:
            after = graph
        assert graph.to_json() == before
        assert SceneGraph.from_json(after.to_json()) == after
        diff = graph.diff(after)
        assert bool(diff) == (after != graph)
        assert diff.touched <= {*graph.names, *after.names}
        graph = after


@settings(deadline=None, max_examples=30)
@given(graphs(min_nodes=2), st.data())
def test_a_relation_is_refused_exactly_when_its_order_gets_a_cycle(graph, data):
    subject, object_ = data.draw(st.permutations(graph.names))[:2]
    predicate = data.draw(predicates)
    stated = (subject, predicate, object_)
    triples = [relation.triple for relation in graph.relations]
    # the obvious twin of the check: networkx on each order
    cyclic = any(
        not networkx.is_directed_acyclic_graph(networkx.DiGraph(list(edges)))
        for edges in ordered_edges([*triples, stated]).values()
    )
    if cyclic or stated in triples:
        with pytest.raises(GraphError, match=f"'{' '.join(stated)}'"):
            graph.relate(*stated)
    else:
        assert graph.relate(*stated).relations[-1].triple == stated


@settings(deadline=None, max_examples=60)
@given(st.lists(st.tuples(st.sampled_from("abcdef"), st.sampled_from("abcdef")).filter(lambda e: e[0] != e[1])))
def test_the_cycle_found_is_one(edges):
    graph = networkx.DiGraph(edges)
    cycle = find_cycle(dict.fromkeys(edges))
    assert bool(cycle) == (not networkx.is_directed_acyclic_graph(graph))
    if cycle:
        assert set(cycle) <= set(edges)
        assert len({less for less, _ in cycle}) == len(cycle)
        assert all(one[1] == two[0] for one, two in itertools.pairwise([*cycle, cycle[0]]))


@settings(deadline=None, max_examples=30)
@given(graphs(), names)
def test_differences_of_one_edit(graph, name):
    if name not in graph.names:
        node = Node(name, "desk")
        assert graph.diff(graph.add_node(node)).added == (node,)
        assert graph.add_node(node).diff(graph).removed == (node,)
