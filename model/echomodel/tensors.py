"""Tensors in files of safetensors whose bytes are told by what they hold."""

import json
import os
from collections.abc import Mapping

from safetensors.torch import save_file
from torch import Tensor

from echomodel.files import whole_file


def write_tensors(path: str | os.PathLike[str], tensors: Mapping[str, Tensor], metadata: Mapping[str, str]) -> None:
    """Write contiguous tensors and texts about them: equal ones are equal bytes, as the texts are put in order."""
    with whole_file(path) as beside:
        save_file(dict(tensors), beside, dict(metadata))
        with beside.open("r+b") as file:
            size = int.from_bytes(file.read(8), "little")
            header = json.dumps(json.loads(file.read(size)), sort_keys=True, ensure_ascii=False, separators=(",", ":"))
            file.seek(8)
            file.write(header.encode().ljust(size))
