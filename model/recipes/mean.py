"""The mean of weights files of one form: of a training from the first to the last, better than either (model card).

    python model/recipes/mean.py BEFORE.safetensors AFTER.safetensors -o MEAN.safetensors

What the first file says of itself stays (Wortsman et al. 2022, model soups).
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import torch
from safetensors.torch import save_file

sys.path.insert(0, str(Path(__file__).parents[1]))

from echomodel.compact.model import read_weights


def main() -> None:
    """Write the mean of the files, tensor by tensor, as precise as the first is."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="+", type=Path)
    parser.add_argument("-o", "--output", type=Path, required=True)
    options = parser.parse_args()
    files = [read_weights(path) for path in options.files]
    form = {key: values.shape for key, values in files[0][1].items()}
    for path, (_, tensors) in zip(options.files, files, strict=True):
        if {key: values.shape for key, values in tensors.items()} != form:
            parser.error(f"{path}: holds other parts than {options.files[0]}, or of other sizes; nothing was written")
    alike = {key: torch.stack([tensors[key] for _, tensors in files]) for key in files[0][1]}
    mean = {key: values.float().mean(0).to(values.dtype) for key, values in alike.items()}
    save_file(mean, options.output, files[0][0])


if __name__ == "__main__":
    main()
