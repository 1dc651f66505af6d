"""Files of tensors are told by what they hold."""

import torch
from safetensors import safe_open
from safetensors.torch import load_file

from echomodel.tensors import write_tensors


def test_equal_tensors_are_equal_bytes_and_read_as_they_were(tmp_path):
    tensors = {"b": torch.arange(6.0).reshape(2, 3), "a": torch.ones(3, dtype=torch.int8)}
    words = {key: f'{{"größe": "{key}\\n"}}\t\x07' for key in "abcdefgh"}
    files = [tmp_path / f"{number}.safetensors" for number in range(6)]
    for file in files:  # safetensors itself puts the words in another order each time
        write_tensors(file, tensors, dict(words))
    assert len({file.read_bytes() for file in files}) == 1
    assert all(torch.equal(found, tensors[name]) for name, found in load_file(files[0]).items())
    with safe_open(files[0], "pt") as handle:
        assert handle.metadata() == words
