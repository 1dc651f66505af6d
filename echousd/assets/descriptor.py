"""Numbers that say what a shape is like: the shape branch's latent of its signed distances, made coarse."""

from collections.abc import Mapping, Sequence

import numpy as np
import torch

from echomodel.echo import EchoModel
from echousd.assets.record import AssetRecord

CELLS = 4  # of the descriptor along a side
WEIGHT = 4.0  # of the distance of two descriptors (0 to 2) against the other costs of a choice


def descriptors(model: object, grids: np.ndarray) -> np.ndarray:
    """(n, d) float32 of unit length from (n, 64, 64, 64) signed distances; raises ValueError without an encoder."""
    if not isinstance(model, EchoModel) or "autoencoder" not in model.model.parts:
        raise ValueError("these weights have no encoder of shapes; use --shapes library or other weights")
    with torch.no_grad():
        latent = model.in_torch.model.autoencoder.encode(torch.as_tensor(np.asarray(grids, np.float32)))
        coarse = torch.nn.functional.adaptive_avg_pool3d(latent, CELLS).flatten(1)
    coarse = coarse - coarse.mean(1, keepdim=True)
    return np.asarray(torch.nn.functional.normalize(coarse, dim=1), np.float32)


def nearness(found: np.ndarray, names: Sequence[str], records: Sequence[AssetRecord]) -> dict[str, Mapping[str, float]]:
    """Object name -> id of a model -> cost of its shape against the generated one.

    Arguments:
        found: (n, d) descriptors of the generated shapes of `names`. records: models, those without a descriptor cost
            as much as one that is not alike at all.
    """
    width = found.shape[1]
    known = np.array([r.descriptor if len(r.descriptor) == width else np.zeros(width) for r in records], np.float32)
    away = WEIGHT * (1.0 - found @ known.reshape(len(records), width).T)
    ids = [record.id for record in records]
    return {name: dict(zip(ids, row, strict=True)) for name, row in zip(names, away.tolist(), strict=True)}
