"""What a run of many rooms is asked: options of every room, variations, and the file `batch.toml` that holds it all."""

from __future__ import annotations

import itertools
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import fields
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from echousd.room.manifest import MAX_SEED
from echousd.room.room import RoomOptions

if TYPE_CHECKING:
    from echousd.assets.choose import AssetWishes


class BatchOptions(BaseModel):
    """Options of every room; those of `echousd.generate` and `RoomOptions`, and how rooms are drawn and shown.

    Arguments:
        relations: relations an object that are told of a room drawn from the room generator (`sample`).
        preview: draw a picture of every room (needs the extra `render`).
        weights: weights file or folder, "" for those that ship. assets: index of a library, "" for none.
        stretch: how much its models may be stretched, 1 to 4. licenses: of models, such as `CC0,CC-BY`, "" = all.
        text: what models shall be like (extra `text`). collect: take them along with their files.
        fit: `keep` all that is asked for, or `drop` what has no place. settle: as it comes to rest (extra `sim`).
        device: what the network runs on, `cpu`, `cuda` or `mps`; it is part of the plan, as sums round by it.
        palette: harmony of the room, "" = the seed chooses.
        merge: what of a piece is one mesh, `parts`, `bodies` or `closed`, see `RoomOptions`.
        materialx: materials have a MaterialX network as well. crate, instances, thumbnails: see `RoomOptions`.
        dress_graph: small things are nodes of the graph on the stage, too, see `RoomOptions`.
        openings: `kept`, those of the graph, or `drawn`, doors and windows where the seed puts them.
        self_contained: every room has its assets and images in its own folder, instead of the run's `store`.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    shapes: str | None = None
    preset: str | None = None
    weights: str = ""
    assets: str = ""
    stretch: Annotated[float, Field(ge=1, le=4)] = 1.15
    licenses: str = ""
    text: str = ""
    collect: bool = False
    fit: Literal["keep", "drop"] = "keep"
    settle: bool = False
    device: Literal["cpu", "cuda", "mps"] = "cpu"
    repair: bool = True
    layouts: Annotated[int, Field(ge=1, le=1000)] = 1
    drafts: Annotated[int, Field(ge=1, le=64)] | None = None
    steps: Annotated[int, Field(ge=1)] | None = None
    faces: Annotated[int, Field(ge=100)] = 5000
    up_axis: str = "Y"
    walls: bool = True
    ceiling: bool = False
    atlas: bool = False
    dress: str = "none"
    palette: str = ""
    merge: Literal["parts", "bodies", "closed"] = "parts"
    materialx: bool = False
    crate: bool = False
    instances: bool = False
    thumbnails: bool = False
    dress_graph: bool = False
    openings: Literal["kept", "drawn"] = "kept"
    preview: bool = True
    relations: Annotated[float, Field(ge=0, le=20)] = 1.5
    self_contained: bool = False

    @property
    def look(self) -> RoomOptions:
        """How a room is written; raises ValueError for a word that is not allowed."""
        return RoomOptions(**{field.name: getattr(self, field.name) for field in fields(RoomOptions)})

    def wishes(self, outside: tuple[str, ...] = ()) -> AssetWishes:
        """What is asked of a library; raises ValueError for what is not allowed or not there.

        Arguments:
            outside: folders besides that of the index in which its models may lie.
        """
        index = Path(self.assets)
        changed = index.stat().st_mtime_ns if self.assets and index.is_file() else 0
        return _wishes(self.assets, changed, self.stretch, self.licenses, self.text, self.collect, outside)


@lru_cache(maxsize=4)  # words are compared with those of all models once in a process
def _wishes(
    assets: str, changed: int, stretch: float, licenses: str, text: str, collect: bool, outside: tuple[str, ...]
) -> AssetWishes:
    from echousd.assets.choose import asked_of

    index, folders = Path(assets) if assets else None, [Path(folder) for folder in outside]
    return asked_of(index, stretch=stretch, licences=licenses or None, collect=collect, text=text, outside=folders)


class BatchRequest(BaseModel):
    """One run: what `batch.toml` holds, field by field.

    Arguments:
        sources: graph files, folders, globs, JSONL or Parquet files of graphs.
        sample: room type -> how many graphs of that type are drawn from the room generator.
        count: rooms of every graph of the sources; seed: of the first, the next one's is one more.
        options: of every room. variations: option -> values; a graph's rooms take the combinations in turn.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    sources: list[str] = []
    sample: dict[str, Annotated[int, Field(ge=1)]] = {}
    count: Annotated[int, Field(ge=1)] = 1
    seed: Annotated[int, Field(ge=0, le=MAX_SEED)] = 0
    options: BatchOptions = BatchOptions()
    variations: dict[str, list[Any]] = {}

    def chosen(self, copy: int) -> BatchOptions:
        """The options of the room number `copy` of a graph."""
        combinations = list(itertools.product(*self.variations.values()))
        values = combinations[copy % len(combinations)]
        return BatchOptions(**{**self.options.model_dump(), **dict(zip(self.variations, values, strict=True))})


def request_of(raw: Mapping[str, Any], where: str) -> BatchRequest:
    """A checked request; raises ValueError that names `where`, the field, what was found and what is allowed."""
    try:
        request = BatchRequest.model_validate(dict(raw))
        if "device" in request.variations:
            raise ValueError(f"{where}: variations: device, allowed: options that a room shows; one device for all")
        if not all(request.variations.values()):
            raise ValueError(f"{where}: variations: an empty list, allowed: at least one value of each option")
        for copy in range(min(len(list(itertools.product(*request.variations.values()))), 1000)):
            _ = request.chosen(copy).look
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        field = ".".join(str(part) for part in first["loc"])
        allowed = first["msg"]
        if first["type"] == "extra_forbidden":
            known = BatchOptions if field.startswith(("options.", *BatchOptions.model_fields)) else BatchRequest
            allowed = f"unknown field, allowed: {', '.join(known.model_fields)}"
        raise ValueError(f"{where}: {field} is {first['input']!r:.80} ({allowed})") from None
    if not request.sources and not request.sample:
        raise ValueError(f"{where}: neither sources nor a sample; name graph files, or --sample bedroom:20")
    return request


def read_toml(path: Path) -> dict[str, Any]:
    """The fields of a `batch.toml`; sources and library are relative to it. Raises ValueError naming the file."""
    try:
        raw = tomllib.loads(path.read_text("utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise ValueError(f"{path}: cannot be read as TOML ({error})") from None
    sources = raw.get("sources", [])
    if isinstance(sources, list) and all(isinstance(source, str) for source in sources):
        raw["sources"] = [str(path.parent / source) for source in sources]
    options = raw.get("options")
    if isinstance(options, dict) and isinstance(options.get("assets"), str) and options["assets"]:
        options["assets"] = str((path.parent / options["assets"]).absolute())
    return raw


def parse_options(words: Sequence[str]) -> dict[str, Any]:
    """`ceiling=true`, `palette=oak` as options, whose values are those of TOML or words; raises ValueError."""
    found: dict[str, Any] = {}
    for word in words:
        name, sign, value = word.partition("=")
        if not (name and sign):
            raise ValueError(f"--set is {word!r}, allowed: an option of a room and its value, such as ceiling=true")
        try:
            found[name] = tomllib.loads(f"value = {value}")["value"]
        except tomllib.TOMLDecodeError:
            found[name] = value
    return found


def parse_sample(text: str) -> dict[str, int]:
    """`bedroom:500,living_room:300` as counts; raises ValueError."""
    from echomodel.vocabulary import vocabulary

    found: dict[str, int] = {}
    for part in filter(None, text.split(",")):
        word, _, number = part.partition(":")
        if not number.isascii() or not number.isdigit() or not 0 < int(number) <= 10**7:
            raise ValueError(f"--sample is {part!r}, allowed: a room type and a count, such as bedroom:500")
        kind = vocabulary().room_type(word.strip()).name
        found[kind] = found.get(kind, 0) + int(number)
    return found


def as_paths(sources: Sequence[str | Path]) -> list[str]:
    """Sources as texts with forward slashes."""
    return [Path(source).as_posix() for source in sources]
