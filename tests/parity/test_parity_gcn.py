"""Triplet convolution, encoder and manipulator against the published ones (tolerance 1e-4)."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch
from drawn_noise import Drawn
from parity_configs import encoder_config
from parity_numbers import Numbers, close, value
from torch import nn

from echoscene.encoder import GraphEncoder, SceneGraphTensors, TripletGCN


@pytest.mark.parametrize("name", ["gcn", "gcn_noresidual"])
def test_triplet_gcn(name: str) -> None:
    numbers = Numbers(name)
    meta = numbers.meta
    net = TripletGCN(
        meta["input_dim_obj"],
        meta["input_dim_pred"],
        meta["hidden_dim"],
        meta["num_layers"],
        meta["output_dim"],
        meta["residual"],
    )
    numbers.fill(net)
    with torch.inference_mode():
        for mode, suffix in ((False, ""), (True, "_trainmode")):
            x, e = net.train(mode)(numbers["x"], numbers["e"], numbers["edges"])
            close(x, numbers[f"out_x{suffix}"], 1e-4)
            close(e, numbers[f"out_e{suffix}"], 1e-4)


def _encoder(own_table: bool = True) -> GraphEncoder:
    """Encoder weights from one file, manipulator weights from the other, each from its own seed."""
    sources = [Numbers("encoder"), Numbers("manipulator")]
    net = GraphEncoder(replace(encoder_config(sources[0]), own_manipulator_table=own_table))
    state = nn.Module.state_dict(net)
    seen = set()
    with torch.no_grad():
        for numbers in sources:
            for key, shape in numbers.keys.items():
                assert list(state[key].shape) == shape, key
                if key not in seen and state[key].is_floating_point():
                    state[key].copy_(torch.from_numpy(value(key, tuple(shape), numbers.seed, numbers.gain)))
                seen.add(key)
    assert set(state) - seen <= {"obj_embeddings_dc.weight", "pred_embeddings_man_dc.weight"}
    return net.eval()


WHOLE = ("objs", "triples", "clip_obj", "clip_rel")


def _graph(n: Numbers, classes: str, triples: str, nodes: str, edges: str) -> SceneGraphTensors:
    return SceneGraphTensors(n[classes], n[triples], n[nodes], n[edges])


def _opened(name: str, own_table: bool = True) -> tuple[GraphEncoder, Numbers, SceneGraphTensors]:
    """Encoder and manipulator, the numbers of one of them and its whole graph."""
    numbers = Numbers(name)
    return _encoder(own_table), numbers, _graph(numbers, *WHOLE)


@torch.inference_mode()
def test_encoder() -> None:
    net, numbers, graph = _opened("encoder")
    nodes, edges = net.embed(graph)
    close(nodes, numbers["obj_embed"], 1e-6)
    close(edges, numbers["pred_embed_enc"], 1e-6)
    latent, latent_edges = net.encode(graph)
    close(latent, numbers["latent_obj"], 1e-4)
    close(latent_edges, numbers["latent_pred"], 1e-4)


@torch.inference_mode()
@pytest.mark.parametrize(("own_table", "expected"), [(True, "manip_obj"), (False, "manip_obj_echoscene_variant")])
def test_manipulator_generates(own_table: bool, expected: str) -> None:
    net, numbers, graph = _opened("manipulator", own_table)
    latent, edges, keep = net.manipulate(numbers["latent_obj"], graph)
    close(latent, numbers[expected], 1e-4)
    assert keep.all()
    if own_table:
        close(edges, numbers["manip_pred"], 1e-4)


@torch.inference_mode()
@pytest.mark.parametrize(
    ("edit", "before", "after", "nodes"),
    [
        ("add", ("add_enc_objs", "add_enc_triples", "add_clip_obj", "add_clip_rel"), WHOLE, ("added", "add_index")),
        ("chg", WHOLE, ("objs", "chg_dec_triples", "clip_obj", "chg_clip_rel"), ("touched", "chg_nodes")),
    ],
)
def test_manipulator_adds_a_node_and_changes_a_relation(edit, before, after, nodes) -> None:
    numbers = Numbers("manipulator")
    net = _encoder()
    latent, _ = net.encode(_graph(numbers, *before))
    graph, (how, which) = _graph(numbers, *after), nodes
    new, _, keep = net.manipulate(
        latent, graph, **{how: numbers[which].tolist()}, generator=Drawn(numbers[f"{edit}_noise"])
    )
    close(new, numbers[f"{edit}_c_b"], 1e-4)
    close(net.embed(graph)[0], numbers[f"{edit}_uc_b"], 1e-6)
    assert keep.long().tolist() == numbers[f"{edit}_keep"].tolist()


@torch.inference_mode()
def test_change_flags_belong_to_the_nodes_in_ascending_order() -> None:
    net, numbers, graph = _opened("manipulator")
    latent, _ = net.encode(graph)
    touched = numbers["chg_nodes"].tolist()
    one, _, _ = net.manipulate(latent, graph, touched=touched, generator=Drawn(numbers["chg_noise"]))
    for order in (sorted(touched), sorted(touched, reverse=True), [*touched, touched[0]]):
        again, _, _ = net.manipulate(latent, graph, touched=order, generator=Drawn(numbers["chg_noise"]))
        assert torch.equal(again, one)
    # An added node behind a touched one gets the second row.
    last = len(graph.classes) - 1
    seen, noise = numbers["chg_noise"][:2], latent[:last]
    late, _, _ = net.manipulate(noise, graph, added=[last], touched=[0], generator=Drawn(seen))
    swapped, _, _ = net.manipulate(noise, graph, added=[last], touched=[0], generator=Drawn(seen.flip(0)))
    assert not torch.equal(late, swapped)
    flagged, _, _ = net.manipulate(
        torch.cat([noise, noise.new_zeros(1, noise.shape[1])]), graph, touched=[0, last], generator=Drawn(seen)
    )
    assert torch.equal(flagged, late)
