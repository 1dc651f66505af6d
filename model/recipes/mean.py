"""The mean of weights files of one form: of a training from the first to the last, better than either (model card).

    python model/recipes/mean.py BEFORE.safetensors AFTER.safetensors -o MEAN.safetensors

What the first file says of itself stays (Wortsman et al. 2022, model soups).
"""

from __future__ import annotations

import argparse
from pathlib import Path

import torch
from safetensors import safe_open
from safetensors.torch import save_file


def main() -> None:
    """Write the mean of the files, tensor by tensor, as precise as the first is."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="+", type=Path)
    parser.add_argument("-o", "--output", type=Path, required=True)
    options = parser.parse_args()
    tensors, said = [], []
    for path in options.files:
        with safe_open(path, "pt") as handle:
            tensors.append({key: handle.get_tensor(key) for key in handle.keys()})  # noqa: SIM118
            said.append(handle.metadata())
    first = tensors[0]
    mean = {key: torch.stack([each[key].float() for each in tensors]).mean(0).to(first[key].dtype) for key in first}
    save_file(mean, options.output, said[0])


if __name__ == "__main__":
    main()
