"""The networks of numpy draw what those of torch draw, from the same noise."""

import numpy as np
import pytest
import torch

from echomodel.boxes import Boxes
from echomodel.compact.modules import Alone
from echomodel.compact.plain import Net
from echomodel.echo import EchoModel
from echomodel.graph import GraphBatch, GraphEdit
from echomodel.openings import Opening
from echomodel.randomness import Noise
from echomodel.vocabulary import vocabulary

BOTH = ("size", "position", "yaw")


@pytest.fixture(scope="module")
def models():
    return EchoModel.load(), EchoModel.load(device=None)


def graph() -> GraphBatch:
    """A bedroom with a window and a door, and an office without a floor."""
    words = vocabulary()
    numbers = [words.category_id(word) for word in ("bed", "nightstand", "nightstand", "lamp", "wardrobe")]
    beside, on = words.predicate_id("close_by"), words.predicate_id("standing_on")
    like = words.predicate_id("same_style_as")
    openings = (Opening("door", "door", 1, 0.4, 0.9, 2.1, 0.0), Opening("window", "window", 3, 1.0, 1.2, 1.2, 0.9))
    first = GraphBatch.single(
        numbers, [(1, beside, 0), (2, beside, 0), (3, on, 1), (1, like, 2)], floor=(4.0, 3.5), openings=openings
    )
    desk = GraphBatch.single([words.category_id("desk"), words.category_id("chair")], [(1, beside, 0)], room_type=1)
    return GraphBatch.pack([first, desk])


def drawn(model, **how):
    return model.sample_layout(graph(), generator=Noise(3), steps=6, relation_guidance=0.0, **how)


def alike(one: Boxes, other: Boxes) -> None:
    assert {getattr(other, name).dtype for name in BOTH} == {np.dtype(np.float32)}
    for name in BOTH:
        assert np.abs(getattr(one, name).numpy() - getattr(other, name)).max() < 1e-4


def test_boxes_are_alike(models):
    alike(*(drawn(model) for model in models))


def test_boxes_beside_known_ones_and_after_an_edit_are_alike(models):
    there = drawn(models[0])
    mask = torch.tensor([True, False, False, True, False, False, True])
    edit = GraphEdit(graph().triplets[:2], torch.tensor([False, False, False, True, False, False, False]))
    found = [drawn(model, known=there, known_mask=mask, edit=edit) for model in models]
    alike(*found)
    kept = mask.numpy()
    assert np.array_equal(found[1].size[kept], there.size.numpy()[kept])
    assert np.abs(found[1].position - drawn(models[1]).position).max() > 0.01  # what is told of an edit counts


def test_guided_boxes_are_alike(models):
    found = [model.sample_layout(graph(), generator=Noise(3), steps=4, relation_guidance=0.1) for model in models]
    for name in BOTH:
        assert np.median(np.abs(getattr(found[0], name).numpy() - getattr(found[1], name))) < 1e-3


def test_furniture_is_alike(models):
    boxes, styles = drawn(models[0]), np.array([0, -1, -1, -1, 0, 1, 1])
    found = [
        np.asarray(model.sample_furniture(graph(), boxes, generator=Noise(5), steps=6, styles=styles))
        for model in models
    ]
    assert found[1].dtype == np.float32
    assert np.abs(found[0] - found[1]).max() < 1e-3
    assert np.array_equal(found[1][1], found[1][2])  # one style, one class


def test_shapes_are_those_of_torch(models):
    alone = GraphBatch.single([vocabulary().category_id("chair")])
    box = Boxes(torch.full((1, 3), 0.5), torch.zeros(1, 3), torch.zeros(1))
    whole, plain = (model.sample_shapes(alone, box, generator=Noise(1), steps=1, candidates=1) for model in models)
    assert np.array_equal(whole.numpy(), plain)


def test_layers_are_those_of_torch():
    layer = Alone(8)
    net = Net({name: value.numpy() for name, value in layer.state_dict().items()}, EchoModel.load(device=None).config)
    x = torch.linspace(-3, 3, 24).reshape(3, 8)
    for name in ("norm", "mlp"):
        assert np.abs(getattr(layer, name)(x).detach().numpy() - getattr(net, name)(x.numpy())).max() < 1e-6
    assert len(list(net.mlp)) == 2
    assert net.mlp
