"""What a run of many rooms is asked: options of every room, variations, and the file `batch.toml` that holds it all."""

import itertools
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, ValidationError

from echomodel.files import raising
from echomodel.vocabulary import vocabulary
from echousd.graph.nodes import PlainModel
from echousd.invalid import validation_message
from echousd.options import FILES, MAX_SEED, ROOM, RoomOptions, row


class BatchOptions(RoomOptions):
    """Options of every room of a run: those of any room, and how graphs are drawn and assets stored."""

    relations: float = row(1.5, ROOM, "relations an object that are told of a room which is drawn", ge=0, le=20)
    self_contained: bool = row(False, FILES, "assets in every room's own folder, not once in the run's store")


class BatchRequest(PlainModel, strict=True):
    """One run: what `batch.toml` holds, field by field.

    Arguments:
        sources: graph files, folders, globs, JSONL or Parquet files of graphs.
        sample: room type -> how many graphs of that type are drawn from the room generator.
        count: rooms of every graph of the sources; seed: of the first, the next one's is one more.
        options: of every room, but for the seed. variations: option -> values; a graph's rooms take the combinations
            in turn.
    """

    sources: list[str] = Field([])
    sample: dict[str, Annotated[int, Field(ge=1)]] = Field({})
    count: Annotated[int, Field(ge=1)] = 1
    seed: Annotated[int, Field(ge=0, le=MAX_SEED)] = 0
    options: BatchOptions = BatchOptions()
    variations: dict[str, list[Any]] = Field({})

    @classmethod
    def _explained(cls, fields: dict[str, Any], error: ValidationError) -> ValueError:
        return ValueError(validation_message(error, cls))

    def chosen(self, copy: int) -> BatchOptions:
        """The options of the room number `copy` of a graph."""
        combinations = list(itertools.product(*self.variations.values()))
        values = dict(zip(self.variations, combinations[copy % len(combinations)], strict=True))
        return self.options.replaced(**values)


def request_of(raw: Mapping[str, Any], where: str) -> BatchRequest:
    """A checked request; raises ValueError that names `where`, the field, what was found and what is allowed."""
    with raising(f"{where}:"):
        request = BatchRequest(**{**raw, "options": _options(raw.get("options", {}))})
        if fixed := {"device", "seed"} & request.variations.keys():
            raise ValueError(f"variations: {fixed.pop()}, allowed: what a room shows; one device for all")
        if not all(request.variations.values()):
            raise ValueError("variations: an empty list, allowed: at least one value of each option")
        for copy in range(min(len(list(itertools.product(*request.variations.values()))), 1000)):
            request.chosen(copy)
    if not request.sources and not request.sample:
        raise ValueError(f"{where}: neither sources nor a sample; name graph files, or --sample bedroom:20")
    return request


def _options(raw: Any) -> BatchOptions:
    if not isinstance(raw, Mapping) or "seed" in raw:
        raise ValueError(f"options is {raw!r:.80}, allowed: names and values, the seed beside them")
    return BatchOptions(**raw)


def read_toml(path: Path) -> dict[str, Any]:
    """The fields of a `batch.toml`; all its paths are relative to it. Raises ValueError naming the file."""
    with raising(f"{path}: cannot be read as TOML", OSError, UnicodeDecodeError, tomllib.TOMLDecodeError):
        raw = tomllib.loads(path.read_text("utf-8"))
    for name, kind, allowed in (("sources", list, "a list of files, folders, globs"), ("sample", dict, "room types")):
        if not isinstance(raw.get(name, kind()), kind):
            raise ValueError(f"{path}: {name} is {raw[name]!r:.80}, allowed: {allowed}")
    raw["sources"] = [str(path.parent / one) if isinstance(one, str) else one for one in raw.get("sources", [])]
    options = raw.get("options")
    if isinstance(options, dict):
        for name in ("assets", "like"):
            if isinstance(options.get(name), str) and options[name]:
                options[name] = str((path.parent / options[name]).absolute())
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

    found: dict[str, int] = {}
    for part in filter(None, text.split(",")):
        word, _, number = part.partition(":")
        if not number.isascii() or not number.isdigit() or not 0 < int(number) <= 10**7:
            raise ValueError(f"--sample is {part!r}, allowed: a room type and a count, such as bedroom:500")
        kind = vocabulary().room_type(word.strip()).name
        found[kind] = found.get(kind, 0) + int(number)
    return found
