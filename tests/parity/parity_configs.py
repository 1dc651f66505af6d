"""Configs of the networks that a fixture file describes in its metadata."""

from __future__ import annotations

from typing import Any

from parity_numbers import Numbers

from echoscene.config import EncoderConfig, UNetConfig, VQConfig


def layout_config(numbers: Numbers) -> UNetConfig:
    """The layout branch of a `layout_*` file."""
    raw = numbers.config
    return UNetConfig(
        channels=raw["in_channels"],
        context=raw["crossattn_dim"],
        objects=numbers["obj_embed"].shape[-1],
        time_in_echo=raw["enable_t_emb"],
        **_unet(raw),
    )


def shape_config(numbers: Numbers) -> UNetConfig:
    """The shape branch of a `shape_*` file; the latent's grid is that of its tensors, `image_size` is never used."""
    raw = numbers.config
    state = numbers["x"] if "x" in numbers else numbers["z0"] if "z0" in numbers else numbers["x_T"]
    return UNetConfig(
        channels=raw["in_channels"],
        context=raw["context_dim"],
        objects=numbers["obj_embed"].shape[-1],
        time_in_echo=raw["enable_t_emb"],
        echo=raw["messsage_passing"],
        grid=state.shape[-1],
        **_unet(raw),
    )


def vq_config(numbers: Numbers) -> VQConfig:
    """The autoencoder of a `vqvae` file."""
    raw = numbers.meta.get("ddconfig", numbers.meta)
    return VQConfig(
        channels=raw["ch"],
        mult=tuple(raw["ch_mult"]),
        blocks=raw["num_res_blocks"],
        latent=numbers.meta["embed_dim"],
        codes=numbers.meta["n_embed"],
        resolution=raw["resolution"],
    )


def encoder_config(encoder: Numbers) -> EncoderConfig:
    """Encoder and manipulator of the `encoder` file (which the `manipulator` file shares)."""
    raw = encoder.meta
    text = encoder["clip_obj"].shape[1]
    return EncoderConfig(
        classes=raw["classes"],
        predicates=raw["predicates"],
        text=text,
        learned=raw["node"] - text,
        flag=raw["embedding_dim"],
        hidden=raw["hidden"],
        layers=raw["layers"],
        residual=raw["residual"],
        separated=False,
        own_manipulator_table=True,
    )


def _unet(raw: dict[str, Any]) -> dict[str, Any]:
    return {
        "width": raw["model_channels"],
        "mult": tuple(raw["channel_mult"]),
        "blocks": raw["num_res_blocks"],
        "attention": tuple(raw["attention_resolutions"]),
        "heads": raw["num_heads"],
    }
