"""Published checkpoints in, one safetensors file out, with config and vocabulary; no pickle is ever executed."""

import json
import math
import os
import pickle
import re
import struct
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any
from zipfile import is_zipfile

import torch
from safetensors import SafetensorError, safe_open
from torch import Tensor, nn

from echomodel.boxes import BoxStatistics
from echomodel.compact.model import check_numbers
from echomodel.config import from_dict
from echomodel.files import raising
from echomodel.tensors import write_tensors
from echomodel.vocabulary import vocabulary
from echoscene.config import EncoderConfig, ReleasedConfig, UNetConfig, VQConfig
from echoscene.model import ReleasedModel
from echoscene.vqvae import VQVAE

FORMAT = "echousd-released-1"


class CheckpointError(ValueError):
    """A file that does not hold the published model; the message names the file's first keys at fault."""


def build(config: ReleasedConfig, tensors: Mapping[str, Tensor], where: str) -> nn.Module:
    """The model of a config with these very tensors as its weights (cast to float32, else not copied).

    Returns `ReleasedModel`, or a module with `vqvae` alone where the config has no encoder.
    Raises CheckpointError: names `where` and the first missing, unexpected and misshapen keys.
    """
    with torch.device("meta"):
        model: nn.Module = ReleasedModel(config) if config.encoder else _Autoencoder(config)
    expected = nn.Module.state_dict(model)
    problems = []
    missing, unexpected = [k for k in expected if k not in tensors], [k for k in tensors if k not in expected]
    wrong = [k for k in expected if k in tensors and expected[k].shape != tensors[k].shape]
    for word, keys in (("missing", missing), ("unexpected", unexpected), ("misshapen", wrong)):
        if keys:
            detail = keys[0]
            if word == "misshapen":
                detail += f" {list(tensors[detail].shape)} instead of {list(expected[detail].shape)}"
            problems.append(f"{len(keys)} {word} (first: {detail})")
    if problems:
        raise CheckpointError(f"{where}: keys do not match the published model: {'; '.join(problems)}")
    state = {k: v.float() if v.is_floating_point() else v for k, v in tensors.items()}
    for key, value in state.items():
        if value.is_floating_point() and not bool(torch.isfinite(value).all()):
            raise CheckpointError(f"{where}: key {key} holds numbers that are not finite")
    model.load_state_dict(state, strict=True, assign=True)
    return model.eval()


class _Autoencoder(nn.Module):
    def __init__(self, config: ReleasedConfig) -> None:
        super().__init__()
        if config.vqvae is None:
            raise CheckpointError("neither an encoder nor an autoencoder is there")
        self.config, self.vqvae = config, VQVAE(config.vqvae)


def write_released(
    target: str | os.PathLike[str], model: nn.Module, config: ReleasedConfig, classes: Sequence[str] | None,
    statistics: BoxStatistics | None,
) -> None:  # fmt: skip
    """Write a model's tensors with config, vocabulary, box statistics and the name of its text encoder, if it has one.

    The file appears whole or not at all.

    Arguments:
        target: the file. model: what `config` describes. classes: names by id. statistics: box normalisation.
    """
    metadata = {
        "format": FORMAT,
        "config": json.dumps(asdict(config)),
        "vocabulary": json.dumps(
            {"classes": classes, "predicates": [p.name for p in vocabulary().predicates]} if config.encoder else None
        ),
        "box_statistics": json.dumps(statistics.to_json() if statistics else None),
    }
    if isinstance(model, ReleasedModel) and model.text_encoder is not None:
        metadata["text_encoder"] = model.text_encoder
    state = {key: value.detach().clone().contiguous() for key, value in nn.Module.state_dict(model).items()}
    target = Path(target)
    target.parent.mkdir(parents=True, exist_ok=True)
    write_tensors(target, state, metadata)


def load_released(path: str | os.PathLike[str]) -> nn.Module:
    """Load a converted file.

    Returns `ReleasedModel` in evaluation mode, or a module with `vqvae` alone.

    Raises:
        CheckpointError: not a converted file, or damaged; names the file and the first keys at fault.
        OSError: the file cannot be read.
    """
    try:
        with safe_open(path, framework="pt") as file:
            metadata = file.metadata() or {}
            if metadata.get("format") != FORMAT:
                raise CheckpointError(
                    f"{path}: format is {metadata.get('format')!r}, expected {FORMAT!r} (echousd convert)"
                )
            raw = json.loads(metadata["config"])
            check_numbers(raw, len(file.keys()))
            config = from_dict(ReleasedConfig, dict(raw))
            words, bounds = json.loads(metadata["vocabulary"]), json.loads(metadata["box_statistics"])
            tensors = {key: file.get_tensor(key) for key in file.keys()}  # noqa: SIM118
    except CheckpointError:
        raise
    except (SafetensorError, KeyError, ValueError, TypeError, AttributeError, RecursionError) as error:
        reason = " ".join(str(error).split())[:200]
        raise CheckpointError(f"{path}: truncated, or not a converted checkpoint ({reason})") from None
    model = build(config, tensors, str(path))
    if isinstance(model, ReleasedModel):
        model.classes = tuple(words["classes"]) if words and words["classes"] else None
        model.statistics = BoxStatistics.from_json(bounds) if bounds else None
        model.text_encoder = metadata.get("text_encoder")
    return model


IGNORED = ("epoch", "counter", "opt")  # what the published training keeps beside the weights
NESTED = ("vqvae", "shape_df")


def read_published(path: str | os.PathLike[str]) -> dict[str, Tensor]:
    """Tensors of a published file by flat name.

    Arguments:
        path: a file written by `torch.save`: a state dict, nested dicts `vqvae` and `shape_df` and training counters
            allowed. A bare autoencoder comes back under `vqvae.`.

    Raises:
        CheckpointError: not such a file, cut short, or holding anything but tensors, numbers and containers of them
            (which is refused, not executed); names the file and the entry.
        OSError: the file cannot be read.
    """
    path = Path(path)
    with path.open("rb") as file:
        head = file.read(16)
    if head[8:9] == b"{" and path.suffix == ".safetensors":
        raise CheckpointError(f"{path}: is a safetensors file already, expected a checkpoint written by torch.save")
    try:
        # Mapped, not read: the optimiser's state in a published file is twice as large as the weights.
        raw = torch.load(path, map_location="cpu", weights_only=True, mmap=is_zipfile(path))
    except pickle.UnpicklingError as error:
        text = str(error)
        named = re.search(r"GLOBAL ([\w.]+)", text) or re.search(r"`?([\w.]+)`? (?:was not an allowed|is not)", text)
        what = f"it refers to {named.group(1)}" if named else "it is not a plain pickle of tensors"
        raise CheckpointError(
            f"{path}: refused, {what}; only tensors, numbers and containers of them are read, nothing is executed"
        ) from None
    except (RuntimeError, EOFError, ValueError, LookupError, AttributeError, TypeError, struct.error) as error:
        reason = str(error).strip().splitlines()[0][:160] if str(error).strip() else type(error).__name__
        raise CheckpointError(f"{path}: truncated, or not a file written by torch.save ({reason})") from None
    if not isinstance(raw, Mapping):
        raise CheckpointError(f"{path}: holds a {type(raw).__name__}, expected a dict of tensors")
    return _flatten(raw, path)


def _flatten(raw: Mapping[Any, Any], path: Path) -> dict[str, Tensor]:
    out: dict[str, Tensor] = {}
    for key, value in raw.items():
        if key in IGNORED:
            continue
        if key in NESTED and isinstance(value, Mapping):
            for inner, tensor in value.items():
                out[f"{key}.{inner}"] = _tensor(f"{key}.{inner}", tensor, path)
        else:
            out[str(key)] = _tensor(str(key), value, path)
    if not out:
        raise CheckpointError(f"{path}: holds no tensors")
    if "quantize.embedding.weight" in out or "encoder.conv_in.weight" in out:
        out = {f"{AUTOENCODER}{key}": tensor for key, tensor in out.items()}
    return out


def _tensor(key: str, value: object, path: Path) -> Tensor:
    if not isinstance(value, Tensor):
        raise CheckpointError(f"{path}: key {key} holds a {type(value).__name__}, expected a tensor")
    return value


def class_names(count: int) -> tuple[str, ...] | None:
    """Names of `count` classes in the order of their ids, or None if no published mapping has as many (14, 15, 36)."""
    words = vocabulary()
    coarse = words.coarse_categories
    if count == len(coarse):
        return coarse
    if count == len(coarse) + 1:  # the mapping that keeps stools apart
        return tuple(sorted([*coarse, "stool"]))
    fine = tuple(sorted({*words.structure, *(c.sgfront for c in words.categories)}))
    return fine if count == len(fine) else None


def convert(
    source: str | os.PathLike[str], target: str | os.PathLike[str], *, classes: Sequence[str] | None = None,
    statistics: BoxStatistics | None = None,
) -> ReleasedConfig:  # fmt: skip
    """Write a published checkpoint as one safetensors file with config, vocabulary and box statistics inside.

    Arguments:
        source: the published file. target: the file to write; appears whole or not at all.
        classes: class names in the order of their ids; None = those of the published mappings.
        statistics: box normalisation; None = unknown (sampling of boxes then asks for it).

    Returns the config read off the keys.
    Raises CheckpointError: as `read_published` and `build`, or the number of class names is wrong.
    """
    tensors = read_published(source)
    with raising(f"{source}:", kind=CheckpointError):
        config = infer_config({key: tuple(value.shape) for key, value in tensors.items()})
    count = config.encoder.classes if config.encoder else 0
    names = class_names(count) if classes is None else tuple(classes)
    if classes is not None and len(classes) != count:
        raise CheckpointError(f"{len(classes)} class names for a model of {count} classes")
    model = build(config, tensors, str(source))
    write_released(target, model, config, names, statistics)
    return config


def statistics_from_bounds(bounds: Sequence[float]) -> BoxStatistics:
    """Fourteen numbers, lowest and highest size (3 + 3, metres), position (3 + 3, metres) and angle (unused).

    Raises ValueError for not fourteen finite numbers, or a highest that is not above its lowest.
    """
    numbers = [float(v) for v in bounds]
    if len(numbers) != 14 or not all(map(math.isfinite, numbers)):
        raise ValueError(f"box bounds: {len(numbers)} numbers, expected 14 finite ones")
    low, high, start, stop = (tuple(numbers[i : i + 3]) for i in (0, 3, 6, 9))
    return BoxStatistics(low, high, start, stop, log_size=False)


def read_bounds(path: str | os.PathLike[str]) -> BoxStatistics:
    """Read a `centered_bounds_*_trainval.txt` file; raises ValueError naming the file."""
    with raising(f"{path}:", ValueError, UnicodeDecodeError):
        return statistics_from_bounds([float(word) for word in Path(path).read_text("utf-8").split()])


Shapes = Mapping[str, tuple[int, ...]]
LAYOUT, SHAPE, AUTOENCODER = "LayoutDiff.df.model.", "shape_df.diffusion_net.", "vqvae."


def infer_config(shapes: Shapes) -> ReleasedConfig:
    """Which parts are there, with which widths and switches.

    Residual connections, the separated graph convolutions, the time embedding in each echo, the number of classes and
    the conditioning are read off the keys. Attention heads (8), attention factors' grid (16) and the resolution of the
    distance grid (64) leave no trace in the shapes and have their published values.

    `shapes`: shape of each parameter; nested dicts joined by dots, a bare autoencoder under `vqvae.`.

    Raises CheckpointError for no known part, or a key that the inference rests on is missing; the message names it.
    """
    names = shapes.keys()
    has = {part: any(key.startswith(part) for key in names) for part in (LAYOUT, SHAPE, AUTOENCODER)}
    encoder = _encoder(shapes, full=has[SHAPE]) if "obj_embeddings_ec.weight" in shapes else None
    if encoder is None and not has[AUTOENCODER]:
        some = ", ".join(sorted(names)[:3]) or "none"
        raise CheckpointError(f"no obj_embeddings_ec.weight and no autoencoder among {len(shapes)} keys ({some} ...)")
    conditioning = "crossattn"
    if "rel_s_mlp.3.weight" in shapes and has[SHAPE]:
        conditioning = "concat" if shapes["rel_s_mlp.3.weight"][0] == 16**3 else "crossattn"
    return ReleasedConfig(
        encoder=encoder,
        layout=_unet(shapes, LAYOUT, "box_graph_cov", "box_embeddings.weight", "box_time_emb") if has[LAYOUT] else None,
        shape=_unet(shapes, SHAPE, "shape_code_graph_cov", "shape_embeddings.5.weight", "shape_time_emb", conditioning)
        if has[SHAPE]
        else None,
        vqvae=_vqvae(shapes) if has[AUTOENCODER] else None,
    )


def _get(shapes: Shapes, key: str, ndim: int) -> tuple[int, ...]:
    if key not in shapes:
        raise CheckpointError(f"missing key {key}")
    if len(shapes[key]) != ndim:
        raise CheckpointError(f"key {key} has shape {list(shapes[key])}, expected {ndim} dimensions")
    return shapes[key]


def _graph(shapes: Shapes, prefix: str) -> tuple[int, int, int, int, int, bool]:
    """Node, edge, hidden and output width, number of layers and residual connections of a graph convolution."""
    layers = 1 + max(
        (int(m[1]) for k in shapes if (m := re.match(re.escape(prefix) + r"gconvs\.(\d+)\.", k))), default=-1
    )
    hidden, columns = _get(shapes, f"{prefix}gconvs.0.net1.0.weight", 2)
    edges = _get(shapes, f"{prefix}gconvs.0.net1.3.weight", 2)[0] - 2 * hidden
    out = _get(shapes, f"{prefix}gconvs.{layers - 1}.net2.3.weight", 2)[0]
    residual = any(k.startswith(prefix) and ".linear_projection." in k for k in shapes)
    if edges <= 0 or (columns - edges) % 2 or columns <= edges:
        raise CheckpointError(
            f"key {prefix}gconvs.0.net1.0.weight has shape {[hidden, columns]}, edges of width {edges}"
        )
    return (columns - edges) // 2, edges, hidden, out, layers, residual


def _encoder(shapes: Shapes, full: bool) -> EncoderConfig:
    rows, learned = _get(shapes, "obj_embeddings_ec.weight", 2)
    node, _, hidden, _, layers, residual = _graph(shapes, "gconv_net_ec.")
    manipulator = _graph(shapes, "gconv_net_manipulation.")[0]
    return EncoderConfig(
        classes=rows - 1, predicates=_get(shapes, "pred_embeddings_ec.weight", 2)[0], text=node - learned,
        learned=learned, flag=manipulator - 2 * node, hidden=hidden, layers=layers, residual=residual,
        separated=any(k.startswith("gconv_net_ec_rel_") for k in shapes), own_manipulator_table=not full,
    )  # fmt: skip


def _unet(shapes: Shapes, prefix: str, gcn: str, code: str, time: str, conditioning: str = "crossattn") -> UNetConfig:
    first = _get(shapes, f"{prefix}input_blocks.0.0.weight", 5 if prefix == SHAPE else 3)
    width, channels = first[0], _get(shapes, f"{prefix}out.2.weight", len(first))[0]
    mult: list[int] = []
    counts: list[int] = [0]
    attention: list[int] = []
    number = 1
    while any(k.startswith(f"{prefix}input_blocks.{number}.") for k in shapes):
        if f"{prefix}input_blocks.{number}.0.op.weight" in shapes:
            counts.append(0)
        else:
            out = _get(shapes, f"{prefix}input_blocks.{number}.0.in_layers.2.weight", len(first))[0]
            level = len(counts) - 1
            mult[level:] = [out // width]
            counts[level] += 1
            if f"{prefix}input_blocks.{number}.1.norm.weight" in shapes and 2**level not in attention:
                attention.append(2**level)
        number += 1
    if not mult or len(set(counts)) != 1:
        raise CheckpointError(f"keys {prefix}input_blocks.*: {counts} residual blocks per level, expected equal counts")
    token = f"{prefix}middle_block.1.transformer_blocks.0.attn2.to_k.weight"
    fields: dict[str, object] = {}
    echo = any(k.startswith(f"{prefix}{gcn}.") for k in shapes)
    if echo:
        nodes, edges, hidden, out, layers, residual = _graph(shapes, f"{prefix}{gcn}.")
        predicates, predicate = _get(shapes, f"{prefix}pred_embeddings.weight", 2)
        size = _get(shapes, f"{prefix}{code}", 2)[0]
        timed = f"{prefix}{time}.weight" in shapes
        fields = {
            "context": out, "objects": nodes - size * (2 if timed else 1), "code": size, "predicate": predicate,
            "predicates": predicates, "edge_features": edges - predicate, "hidden": hidden, "layers": layers,
            "residual": residual, "time_in_echo": timed,
        }  # fmt: skip
    else:
        context = _get(shapes, token, 2)[1]
        fields = {"context": context, "objects": context}
    own = {"channels": channels, "width": width, "mult": tuple(mult), "blocks": counts[0], **fields}
    attended = tuple(sorted(attention, reverse=True))
    return UNetConfig(**own, attention=attended, echo=echo, conditioning=conditioning)  # type: ignore[arg-type]


def _vqvae(shapes: Shapes) -> VQConfig:
    channels = _get(shapes, f"{AUTOENCODER}encoder.conv_in.weight", 5)[0]
    mult: list[int] = []
    blocks = 1
    while f"{AUTOENCODER}encoder.down.{len(mult)}.block.0.conv1.weight" in shapes:
        mult.append(_get(shapes, f"{AUTOENCODER}encoder.down.{len(mult)}.block.0.conv1.weight", 5)[0] // channels)
    while f"{AUTOENCODER}encoder.down.0.block.{blocks}.conv1.weight" in shapes:
        blocks += 1
    codes, latent = _get(shapes, f"{AUTOENCODER}quantize.embedding.weight", 2)
    return VQConfig(channels=channels, mult=tuple(mult), blocks=blocks, latent=latent, codes=codes)
