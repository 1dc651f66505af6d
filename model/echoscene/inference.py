"""The config that the parameter names and shapes of a published file imply (SPEC: section 12)."""

from __future__ import annotations

import re
from collections.abc import Mapping

from echoscene.config import EncoderConfig, ReleasedConfig, UNetConfig, VQConfig

Shapes = Mapping[str, tuple[int, ...]]
LAYOUT, SHAPE, VQVAE = "LayoutDiff.df.model.", "shape_df.diffusion_net.", "vqvae."


class CheckpointError(ValueError):
    """A file that does not hold the published model; the message names the file's first keys at fault."""


def infer_config(shapes: Shapes) -> ReleasedConfig:
    """Which parts are there, with which widths and switches.

    Residual connections, the separated graph convolutions, the time embedding in each echo, the number of classes and
    the conditioning are read off the keys. Attention heads (8), attention factors' grid (16) and the resolution of the
    distance grid (64) leave no trace in the shapes and have their published values.

    Arguments:
        shapes: shape of each parameter; nested dicts joined by dots, a bare autoencoder under `vqvae.`.

    Raises:
        CheckpointError: no known part, or a key that the inference rests on is missing; the message names it.
    """
    names = shapes.keys()
    has = {part: any(key.startswith(part) for key in names) for part in (LAYOUT, SHAPE, VQVAE)}
    encoder = _encoder(shapes, full=has[SHAPE]) if "obj_embeddings_ec.weight" in shapes else None
    if encoder is None and not has[VQVAE]:
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
        vqvae=_vqvae(shapes) if has[VQVAE] else None,
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
        classes=rows - 1,
        predicates=_get(shapes, "pred_embeddings_ec.weight", 2)[0],
        text=node - learned,
        learned=learned,
        flag=manipulator - 2 * node,
        hidden=hidden,
        layers=layers,
        residual=residual,
        separated=any(k.startswith("gconv_net_ec_rel_") for k in shapes),
        own_manipulator_table=not full,
    )


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
    return UNetConfig(
        channels=channels,
        width=width,
        mult=tuple(mult),
        blocks=counts[0],
        attention=tuple(sorted(attention, reverse=True)),
        echo=echo,
        conditioning=conditioning,
        **fields,  # type: ignore[arg-type]
    )


def _vqvae(shapes: Shapes) -> VQConfig:
    channels = _get(shapes, f"{VQVAE}encoder.conv_in.weight", 5)[0]
    mult: list[int] = []
    blocks = 1
    while f"{VQVAE}encoder.down.{len(mult)}.block.0.conv1.weight" in shapes:
        mult.append(_get(shapes, f"{VQVAE}encoder.down.{len(mult)}.block.0.conv1.weight", 5)[0] // channels)
    while f"{VQVAE}encoder.down.0.block.{blocks}.conv1.weight" in shapes:
        blocks += 1
    codes, latent = _get(shapes, f"{VQVAE}quantize.embedding.weight", 2)
    return VQConfig(channels=channels, mult=tuple(mult), blocks=blocks, latent=latent, codes=codes)
