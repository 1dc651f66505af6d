import pickle
from pathlib import Path

import numpy as np
import pytest
import torch

from echomodel import loading
from echomodel.compact.model import load_weights
from echomodel.compact.plain import Net, Table
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
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    path = tmp_path / "weights.safetensors"
    path.write_bytes(b"1")
    first = load_model(path)
    assert load_model(str(path)) is first
    path.write_bytes(b"22")
    assert load_model(path) is not first
    assert load_model(path, device="cuda") is not load_model(path)
    assert read == [(path, "cpu"), (path, "cpu"), (path, "cuda")]


@pytest.mark.parametrize("device", ["cuda", "mps", "cuda:1", "tpu"])
def test_a_device_that_is_not_there_is_refused(device, monkeypatch):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    monkeypatch.setattr(torch.backends.mps, "is_available", lambda: False)
    with pytest.raises(ValueError, match=rf"device is '{device}', which torch .* finds none of; here: cpu$"):
        load_model(device=device)


def test_what_ships_is_loaded_as_arrays_and_whole_where_shapes_need_it():
    model = loading.load_model()
    assert isinstance(model, EchoModel)
    assert model.device is None
    assert not hasattr(model.model, "shape")
    assert model.branches == {"layout", "furniture", "shape"}
    files = sorted((Path(loading.__file__).parent / "weights").glob("*.safetensors"))
    whole, name = load_weights(files)
    assert model.hash == name
    for part in ("shape", "autoencoder"):
        own = model.in_torch.model.get_submodule(part).state_dict()
        assert all(torch.equal(own[key], value) for key, value in whole.get_submodule(part).state_dict().items())
    again = pickle.loads(pickle.dumps(loading.load_model()))
    for part in ("latent", "layout", "furniture"):
        numbers = {key: getattr(whole, part).state_dict()[key].numpy() for key in getattr(whole, part).state_dict()}
        assert flat(getattr(again.model, part)).keys() == numbers.keys()
        assert all(np.array_equal(value, numbers[key]) for key, value in flat(getattr(again.model, part)).items())


def flat(net: object, before: str = "") -> dict[str, np.ndarray]:
    """All numbers of a network of numpy by their names."""
    out: dict[str, np.ndarray] = {}
    for name, part in vars(net).items():
        if isinstance(part, np.ndarray) and name != "transposed":
            out[f"{before}{'weight' if name == 'rows' else name}"] = part
        elif isinstance(part, Net | Table):
            out |= flat(part, f"{before}{name}.")
    return out


def test_a_default_model_brings_no_published_network_and_no_compiler(loaded_by):
    loaded = loaded_by("from echomodel.loading import load_model; load_model(None)")
    assert not {"echoscene", "torch", "sympy"} & loaded
