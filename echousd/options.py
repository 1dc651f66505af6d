"""The options of a room, one row each: name, default, what is allowed, help.

Flags of commands, `batch.toml`, `--set`, the manifest and the signatures of Python are made of this table.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from inspect import Parameter, signature
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar, get_args

from pydantic import AfterValidator, BaseModel, BeforeValidator, Field, ValidationError, model_validator
from pydantic.fields import FieldInfo

from echomodel.late import Late
from echousd.assets import STRETCH
from echousd.graph.fields import RESIDENTS, SHAPES
from echousd.graph.nodes import PlainModel
from echousd.shapes import FACES

validation_message = Late("echousd.invalid:validation_message")

MAX_SEED = 2**63 - 1  # what a layer stores as a whole number
# options of an edit: how what is new is made; all others stay those of the room
OF_NEW = (
    "seed", "shapes", "weights", "device", "drafts", "steps", "place", "faces",
    "assets", "stretch", "licenses", "text", "collect",
)  # fmt: skip
ROOM, MODELS, LOOK, FILES = GROUPS = "Room", "Models of a library", "Look", "Files"


def row(
    default: Any, group: str, help: str, *, everyday: bool = False, words: str = "", flag: str = "", **limits: Any
) -> Any:
    """A row of the table.

    Arguments:
        help: a sentence part, without the default. everyday: on the first page of a command's help.
        words: what stands for the value there; flag: its name there, where Python takes the word for its own.
        limits: of numbers, as pydantic calls them.
    """
    extra: Any = {"group": group, "everyday": everyday, "words": words, "flag": flag}
    return Field(default, description=help, json_schema_extra=extra, **limits)


def _one_of(option: str, words: Callable[[], tuple[str, ...]]) -> AfterValidator:
    def check(name: str) -> str:
        if name not in words():
            raise ValueError(f"{option} is {name!r}, allowed: {', '.join(words())}")
        return name

    return AfterValidator(check)


def _palette(name: str) -> str:
    if name:
        from echousd.shapes.finishes.slots import HARMONIES  # with tables that take a tenth of a second to read

        if name not in HARMONIES:
            raise ValueError(f"palette is {name!r}, allowed: {', '.join(HARMONIES)}")
    return name


def _licences(text: str) -> str:
    if not any(word.strip() for word in text.split(",")):
        raise ValueError(f"licenses is {text!r}, allowed: licences with commas between, such as CC0,CC-BY")
    return text


File = Annotated[str, BeforeValidator(lambda value: str(value) if isinstance(value, Path) else value)]


class Look(BaseModel, frozen=True, strict=True, allow_inf_nan=False):
    """How a room looks and is written: what its manifest keeps, so that an edit goes on with it."""

    walls: bool = row(True, LOOK, "walls, with doors and windows", everyday=True)
    ceiling: bool = row(False, LOOK, "add a ceiling", everyday=True)
    dress: Literal["none", "some", "full"] = row("some", LOOK, "small things, rugs, curtains", everyday=True)
    dress_graph: bool = row(False, LOOK, "small things are nodes of the graph, too, in their own layer")
    palette: Annotated[str, AfterValidator(_palette)] = row(
        "", LOOK, "colours, as oak; else by the seed", everyday=True, words="name"
    )
    up_axis: Annotated[Literal["Y", "Z"], BeforeValidator(lambda word: str(word).upper())] = row(
        "Y", FILES, "axis up, in assets too", everyday=True
    )
    meters_per_unit: float = row(1.0, FILES, "unit of the files, in assets too", ge=1e-6, le=1e6)
    room_path: str = row(
        "/Room", FILES, "prim path of the room", words="path", max_length=200,
        pattern=r"^(/[\p{XID_Start}_]\p{XID_Continue}*)+$",  # letters of any script
    )  # fmt: skip
    faces: int = row(FACES, FILES, "face budget of each mesh", ge=100)
    atlas: bool = row(False, FILES, "unwrap without overlaps, not along the axes (extra: texture)")
    materialx: bool = row(False, FILES, "materials have a MaterialX network beside UsdPreviewSurface")
    instances: bool = row(False, FILES, "pieces that share an asset are instances of it: less memory, no overrides")
    thumbnails: bool = row(False, FILES, "a picture of every asset in its folder (extra: render)")
    crate: bool = row(False, FILES, "layers as usdc, which open faster, not as text; with a store they always are")

    @model_validator(mode="after")
    def _agree(self) -> Look:
        if self.dress_graph and self.dress == "none":
            raise ValueError("dress_graph writes small things into the graph, but dress is 'none', allowed: some, full")
        return self


class RoomOptions(PlainModel, Look):
    """What is asked of a room beside its graph; frozen, raises ValueError in one line for what is not allowed."""

    seed: int = row(0, ROOM, "seed of all randomness", everyday=True, ge=0, le=MAX_SEED)
    shapes: Annotated[str, _one_of("shapes", lambda: SHAPES)] | None = row(
        None, ROOM, "parts, sdf, library, guided or boxes", everyday=True, words="name"
    )  # fmt: skip
    layouts: int = row(1, ROOM, "arrangements, as variants", everyday=True, ge=1, le=1000)
    weights: File | None = row(None, ROOM, "weights file or folder, from convert or train; else those that ship")
    device: Literal["cpu", "cuda", "mps"] = row("cpu", ROOM, "what the network runs on")
    drafts: int | None = row(None, ROOM, "layouts to choose the best from; else 8, fewer in large rooms", ge=1, le=64)
    steps: int | None = row(None, ROOM, "sampling steps; else the model's", ge=1)
    fit: Literal["keep", "drop"] = row("keep", ROOM, "keep all that is asked for, or leave out what has no place")
    place: bool = row(True, ROOM, "move and size boxes as little as possible until the graph is kept")
    resident: Annotated[str, _one_of("resident", lambda: RESIDENTS)] | None = row(
        None, ROOM, "who lives there, told by small things; else as the furniture suggests", everyday=True, flag="for",
        words="|".join(RESIDENTS),
    )  # fmt: skip
    openings: Literal["kept", "doors", "drawn"] = row("kept", ROOM, "the graph's, its doors alone, or new by the seed")
    settle: bool = row(False, ROOM, "simulate the room, put everything where it rests (extra: sim)")
    assets: File | None = row(None, MODELS, "index of a library of models", everyday=True)
    stretch: float = row(STRETCH, MODELS, "how much models may be stretched", ge=1, le=4)
    licenses: Annotated[str, AfterValidator(_licences)] | None = row(
        None, MODELS, "licences that are allowed, such as CC0,CC-BY; else all"
    )
    text: str = row("", MODELS, 'what models shall be like, such as "mid-century oak" (extra: text)', words="words")
    collect: bool = row(False, MODELS, "take models along with their files instead of referring to them")
    preview: bool = row(True, FILES, "draw a picture of the room (extra: render)")
    like: File | None = row(None, FILES, "stage whose unit, up axis and room's path stand for those that are not given")

    @model_validator(mode="before")
    @classmethod
    def _as_theirs(cls, fields: Any) -> Any:
        """What `like` says becomes values of its own, which need the stage no more."""
        if not isinstance(fields, dict) or not fields.get("like"):
            return fields
        from echousd.stage.files import open_stage
        from echousd.stage.units import conventions

        plain = {name: cls.model_fields[name].default for name in ("meters_per_unit", "up_axis", "room_path")}
        own = {name: value for name, value in fields.items() if name != "like" and plain.get(name) != value}
        return {**conventions(open_stage(fields["like"]), own.get("room_path")), **own}

    @model_validator(mode="after")
    def _models(self) -> RoomOptions:
        if self.text and self.assets is None:
            raise ValueError(f"text {self.text!r} needs models to choose from; name a library's index (assets)")
        return self

    @classmethod
    def _explained(cls, fields: dict[str, Any], error: ValidationError) -> ValueError:
        return ValueError(validation_message(error, cls))


def words_of(field: FieldInfo) -> str:
    """What stands for a field's value in help: its words, or the kind of value."""
    extra: Any = field.json_schema_extra
    literal = [str(word) for word in get_args(field.annotation) if isinstance(word, str)]
    return extra["words"] or "|".join(literal)


Function = TypeVar("Function", bound=Callable[..., Any])


def takes_options(names: Collection[str] = tuple(RoomOptions.model_fields)) -> Callable[[Function], Function]:
    """Show rows of the table in place of a function's `**changes` in its signature."""

    def shown(function: Function) -> Function:
        own = [one for one in signature(function).parameters.values() if one.kind is not Parameter.VAR_KEYWORD]
        table = RoomOptions.model_fields
        rows = [Parameter(name, Parameter.KEYWORD_ONLY, default=table[name].default) for name in names]
        function.__signature__ = signature(function).replace(parameters=[*own, *rows])  # type: ignore[attr-defined]
        return function

    return shown
