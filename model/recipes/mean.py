"""The mean of weights files of one form: of a training from the first to the last, better than either (model card).

    python model/recipes/mean.py BEFORE.safetensors AFTER.safetensors -o MEAN.safetensors

What the first of the files that know the most words says of itself stays, and what a word means is the mean of those
that know it (Wortsman et al. 2022, model soups).
"""

import argparse
import sys
from pathlib import Path

import torch

sys.path.insert(0, str(Path(__file__).parents[1]))

from echomodel.compact.model import read_weights
from echomodel.compact.weights import grown_tables, joined_config, words_of
from echomodel.tensors import write_tensors


def main() -> None:
    """Write the mean of the files, tensor by tensor, as precise as the first is."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="+", type=Path)
    parser.add_argument("-o", "--output", type=Path, required=True)
    options = parser.parse_args()
    files = {path: read_weights(path) for path in options.files}
    config = joined_config({path: header for path, (header, _) in files.items()})
    known = {path: words_of(path, header) for path, (header, _) in files.items()}
    grown = [grown_tables(tensors, known[path], config) for path, (_, tensors) in files.items()]
    form = {key: values.shape for key, values in grown[0].items()}
    for path, tensors in zip(files, grown, strict=True):
        if {key: values.shape for key, values in tensors.items()} != form:
            parser.error(f"{path}: holds other parts than {options.files[0]}, or of other sizes; nothing was written")
    mean = {}
    for key, first in grown[0].items():
        each = torch.stack([tensors[key].float() for tensors in grown])
        for row, (_, tensors) in enumerate(files.values()):
            each[row, len(tensors[key]) :] = torch.nan  # words that this file does not know
        mean[key] = each.nanmean(0).to(first.dtype)
    most = max(files, key=lambda path: sum(map(len, known[path].values())))
    write_tensors(options.output, mean, files[most][0])


if __name__ == "__main__":
    main()
