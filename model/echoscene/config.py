"""Sizes and switches of the published networks, and their `released` and `paper` presets."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from echomodel.config import from_dict


@dataclass(frozen=True)
class EncoderConfig:
    """Graph encoder and manipulator (SPEC: paper section 3.2).

    Arguments:
        classes: object classes, with `_scene_` and `floor`; the embedding table has one more, unused row.
        predicates: relation types.
        text: width of the text features.
        learned: width of the learned label embeddings.
        flag: width of the change flag of a node (random for touched nodes, zero otherwise).
        hidden, layers: message width and depth of the graph convolutions.
        residual: graph convolutions carry linear maps of their inputs.
        separated: the unused per-branch graph convolutions are stored too (they are never called).
        own_manipulator_table: the manipulator embeds predicates by `pred_embeddings_man_dc` (the published layout
            model) rather than by the encoder's table (the published full model).
    """

    classes: int = 14
    predicates: int = 16
    text: int = 512
    learned: int = 128
    flag: int = 64
    hidden: int = 256
    layers: int = 5
    residual: bool = True
    separated: bool = True
    own_manipulator_table: bool = False

    @property
    def node(self) -> int:
        """Width of a node's embedding: text, then learned."""
        return self.text + self.learned


@dataclass(frozen=True)
class UNetConfig:
    """A denoising U-Net with its echo; the defaults are the layout branch's published sizes.

    Arguments:
        channels: input and output channels (8 box numbers, or latent channels).
        width: channels of the first level.
        mult: width factor of each level.
        blocks: residual blocks per level.
        attention: downsampling factors at which transformer blocks stand.
        heads: attention heads.
        context: width of the echo's output, the one token of the cross-attention.
        objects: width of the per-node condition.
        code: width of the echo's code of the noisy state, and of its code of the time.
        predicate: width of the echo's predicate embedding.
        predicates: rows of the predicate table.
        edge_features: width of further edge features beside the predicate embedding (0 in the published code).
        hidden, layers: message width and depth of the echo's graph convolution.
        residual: the graph convolution carries linear maps of its inputs.
        time_in_echo: the echo sees the time embedding (ablation: no time embedding in the echo).
        echo: nodes exchange messages at every step (ablation: no echoes, the condition alone).
        conditioning: `crossattn`, or `concat` (ablation, shapes only): the context is one more input channel.
        grid: voxels along an axis of the latent (shapes only).
    """

    channels: int = 8
    width: int = 512
    mult: tuple[int, ...] = (1, 1, 1, 1)
    blocks: int = 2
    attention: tuple[int, ...] = (4, 2)
    heads: int = 8
    context: int = 1280
    objects: int = 640
    code: int = 64
    predicate: int = 128
    predicates: int = 16
    edge_features: int = 0
    hidden: int = 256
    layers: int = 5
    residual: bool = True
    time_in_echo: bool = True
    echo: bool = True
    conditioning: str = "crossattn"
    grid: int = 16

    def __post_init__(self) -> None:
        if self.conditioning not in ("crossattn", "concat"):
            raise ValueError(f"conditioning is {self.conditioning!r}, allowed: crossattn, concat")
        if not self.echo and self.conditioning == "crossattn" and self.objects != self.context:
            raise ValueError(
                f"without echo the condition is the context: objects is {self.objects}, context {self.context}"
            )


SHAPE: Mapping[str, Any] = {"channels": 3, "width": 224, "mult": (1, 2, 3), "objects": 1280}


def shape_unet(**changes: Any) -> UNetConfig:
    """The shape branch's published sizes, with `changes`."""
    return UNetConfig(**{**SHAPE, **changes})


@dataclass(frozen=True)
class VQConfig:
    """The shape autoencoder: widths, codebook and resolution of the signed distance grid."""

    channels: int = 64
    mult: tuple[int, ...] = (1, 2, 4)
    blocks: int = 1
    latent: int = 3
    codes: int = 8192
    resolution: int = 64


@dataclass(frozen=True)
class ReleasedConfig:
    """The whole published model (the defaults), or the parts of it that a file holds (None = absent).

    Arguments:
        preset: `released` (the published wiring: both denoisers see the object embedding only, although the encoder
            and the manipulator run) or `paper` (they see the embedding and the latent of the manipulated graph, and
            edges carry text features, as the paper writes).
        encoder, layout, shape, vqvae: the parts.
    """

    preset: str = "released"
    encoder: EncoderConfig | None = field(default_factory=EncoderConfig)
    layout: UNetConfig | None = field(default_factory=UNetConfig)
    shape: UNetConfig | None = field(default_factory=shape_unet)
    vqvae: VQConfig | None = field(default_factory=VQConfig)

    def __post_init__(self) -> None:
        if self.preset not in ("released", "paper"):
            raise ValueError(f"preset is {self.preset!r}, allowed: released, paper")


# What a recipe's `[paper]` may say -> the field of each part's configuration that it is; `time_in_echo`, `echo` and
# `conditioning`, of the shape branch, are the switches of table 4.
BRANCH = {name: name for name in ("hidden", "layers", "context", "code", "heads", "blocks", "grid")}
SETTINGS = {
    "encoder": {name: name for name in ("text", "learned", "flag", "hidden", "layers")},
    "layout": {**BRANCH, "layout_width": "width", "layout_mult": "mult"},
    "shape": {**BRANCH, "shape_width": "width", "shape_mult": "mult", "time_in_echo": "time_in_echo", "echo": "echo",
              "conditioning": "conditioning"},
    "vqvae": {"vq_channels": "channels", "vq_codes": "codes"},
}  # fmt: skip


def paper(classes: int = 14, settings: Mapping[str, Any] | None = None) -> ReleasedConfig:
    """The paper's wiring: latents reach both denoisers, edges carry text features; at the paper's sizes or others.

    `settings`: of `SETTINGS`; what is not said is as the paper has it, the autoencoder's grid 4 times the latents'.

    Raises ValueError naming an unknown or mistyped setting.
    """
    known = {name for names in SETTINGS.values() for name in names}
    for name in settings or {}:
        if name not in known:
            raise ValueError(f"unknown field 'paper.{name}', allowed: {', '.join(sorted(known))}")
    published = {
        part: {field: settings[name] for name, field in names.items() if settings and name in settings}
        for part, names in SETTINGS.items()
    }
    encoder = from_dict(EncoderConfig, {"classes": classes, "separated": False, **published["encoder"]}, "paper")
    common = {"edge_features": encoder.text, "predicate": encoder.learned}
    layout = from_dict(UNetConfig, {"objects": 2 * encoder.node, **common, **published["layout"]}, "paper")
    # the condition of the shapes is as wide as what reaches the U-Net where no echo stands between them
    volume = published["shape"].get("conditioning") == "concat" and not published["shape"].get("echo", True)
    objects = layout.grid**3 if volume else layout.context
    shape = from_dict(UNetConfig, {**SHAPE, "objects": objects, **common, **published["shape"]}, "paper")
    vqvae = from_dict(VQConfig, {"resolution": 4 * layout.grid, **published["vqvae"]}, "paper")
    return ReleasedConfig("paper", encoder, layout, shape, vqvae)
