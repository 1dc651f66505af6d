import pickle
from pathlib import Path

import pytest
import torch

from echomodel import loading
from echomodel.compact.model import load_weights
from echomodel.echo import EchoModel
from echomodel.loading import load_model


@pytest.fixture(autouse=True)
def fresh():
    loading._loaded.cache_clear()
    yield
    loading._loaded.cache_clear()


def test_a_file_is_read_once_until_it_changes(tmp_path, monkeypatch):
    class Model:
        preset = "compact"

    read = []
    monkeypatch.setattr("echomodel.echo.EchoModel.load", lambda path, device: read.append((path, device)) or Model())
    path = tmp_path / "weights.safetensors"
    path.write_bytes(b"1")
    first = load_model(path)
    assert load_model(str(path)) is first
    path.write_bytes(b"22")
    assert load_model(path) is not first
    assert load_model(path, device="cuda") is not load_model(path)
    assert read == [(path, "cpu"), (path, "cpu"), (path, "cuda")]


def test_formats_are_those_that_are_written():
    from echomodel.compact.model import FORMAT
    from echoscene.weights import FORMAT as PUBLISHED

    assert set(loading.LOADERS) == {FORMAT, PUBLISHED}
    assert loading.COMPACT == FORMAT


def test_weights_that_few_rooms_need_are_read_when_they_are_asked_for():
    model = EchoModel.load().model
    assert {"latent", "layout", "furniture", "shape", "autoencoder"} == set(model.parts)
    assert set(model.later) == {"shape", "autoencoder"}
    assert not any(name.startswith(("shape.", "autoencoder.")) for name in model.state_dict())
    whole, _ = load_weights(sorted((Path(loading.__file__).parent / "weights").glob("*.safetensors")))
    again = pickle.loads(pickle.dumps(EchoModel.load())).model
    for part in ("shape", "autoencoder"):
        own, read = model.get_submodule(part).state_dict(), again.get_submodule(part).state_dict()
        for key, value in whole.get_submodule(part).state_dict().items():
            assert torch.equal(own[key], value)
            assert torch.equal(read[key], value)
    assert model.later == {}
    with pytest.raises(AttributeError, match="colour"):
        _ = model.colour


def test_a_default_model_brings_no_published_network_and_no_compiler(loaded_by):
    loaded = loaded_by("from echomodel.loading import load_model; load_model(None)")
    assert not {"echoscene", "torch._dynamo", "sympy"} & loaded
