"""Small things that make a room look lived in: what there is, what it is called, and programs that build it of solids.

One row per kind (`things.toml`), and per print (`prints.toml`) by the name of its material; the words stand beside the
furniture's vocabulary, because no graph and no weights know them.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from echomodel.files import tables
from echomodel.furniture.carpentry import Size, both
from echomodel.furniture.solids import Block, Lathe, Solid, ball, rotation, tube
from echomodel.late import Late
from echomodel.rows import RoomStyle

Pad = Late("echomodel.furniture.pads:Pad")
Program = Callable[..., list[Solid]]  # of extents (3,) and a generator; `shown`, a row of `prints.toml`, by name
Size3 = tuple[float, float, float]
Row = Mapping[str, Any]  # as `things.toml` says
# of sheets that show the rows of `prints.toml`: what is printed on pictures and cloths and woven into rugs
ASPECTS = {
    "tall": 0.74, "wide": 1.45, "rug": 1.5, "round": 1.0, "oval": 1.5, "runner": 3.0, "square": 1.0, "lumbar": 1.7,
    "spines": 0.46,
}  # fmt: skip
TABLE = Path(__file__).with_name("prints.toml")
PRINTS: Mapping[str, Row] = tables(TABLE.name, __file__)


@dataclass(frozen=True)
class Kind:
    """One kind of small thing.

    Arguments:
        name: its category in our files. ade20k: its ADE20K class.
        program: builds it. low, high: usual extents, metres; what is fitted to its place has extents of its own.
        fixed: hangs or lies still; others are rigid bodies.
        lies: cloth that lies on something and carries nothing itself.
        yields: cloth that hangs and gives way, to the door of a wardrobe say.
        faces: most triangles of its mesh. gives: metres that its soft base gives way where it stands.
    """

    name: str
    ade20k: str
    program: Program
    low: Size3
    high: Size3
    fixed: bool = False
    lies: bool = False
    yields: bool = False
    faces: int = 1200
    gives: float = 0.0


BUILT = {"round": "round_rug", "oval": "round_rug", "lumbar": "lumbar_cushion"}  # form of a print -> what shows it


def _kinds() -> dict[str, Kind]:
    """Rows of `things.toml` by the names of their programs, and those of `prints.toml` as things that show them."""
    rows = tables("things.toml", __file__)
    made = {}
    for name, row in rows.items():
        forms = row.pop("forms", [row.pop("parts")] if "parts" in row else [])
        program = _form(forms) if forms else Late(f"{__name__}.{row.pop('module')}:{row.pop('program', name)}")
        program = partial(program, **row.pop("set", {}))
        made[name] = Kind(program=program, low=tuple(row.pop("low")), high=tuple(row.pop("high")), **row)
    for name, row in PRINTS.items():
        if kind := made.get(BUILT.get(row["form"], name.partition("_")[0])):
            made[name] = replace(kind, program=partial(kind.program, shown=name))
    return made


def _form(forms: Sequence[Sequence[Row]]) -> Callable[[Size, np.random.Generator], list[Solid]]:
    """The program that builds a thing of the rows of one of its forms."""

    def built(size: Size, rng: np.random.Generator) -> list[Solid]:
        parts: list[Solid] = []
        luck = rng.random()
        for row in forms[int(rng.integers(len(forms)))]:
            among = [row["of"]] if isinstance(row["of"], str) else row["of"]
            count = max(1, round(size[0] / row["every"])) if "every" in row else 1
            solid = _solid(row, np.asarray(size, float) / (count, 1, 1), among[int(luck * len(among))])
            for step in size[0] * ((np.arange(count) + 0.5) / count - 0.5):
                copy = replace(solid, centre=solid.centre + np.array([step, 0, 0]))
                parts += both(copy) if row.get("both") else [copy]
        return parts

    return built


def _solid(row: Row, size: Size, material: str) -> Solid:
    turn = rotation(*np.radians(row.get("turn", (0, 0, 0))))
    if "box" in row:
        low, high = (np.array(corner) * size for corner in (row["box"][:3], row["box"][3:]))
        kind = partial(Pad, crown=row["crown"]) if "crown" in row else Block
        made: Solid = kind((low + high) / 2, turn, material, half=(high - low) / 2, radius=row.get("round", 0.0))
        return made
    if "ball" in row:
        middle, half = (np.array(numbers) * size for numbers in (row["ball"][:3], row["ball"][3:]))
        return ball(middle, half, material, power=row.get("power", 2.0), turn=turn)
    if "rod" in row:
        return tube(np.array(row["rod"]) * size, row["thick"] / 2, material)
    profile = np.array(row["turned"]) * (row.get("wide", 1.0) * min(size[0], size[2]) / 2, size[1])
    return Lathe(np.array(row.get("at", (0, 0, 0))) * size, turn, material, profile=profile)


KINDS: dict[str, Kind] = _kinds()
FORMS = 12  # of a kind: rooms share them, and hardly any has two that are alike


def _category(name: str) -> Kind:
    """The kinds of one category, which agree but for their sizes, as one from the least to the largest."""
    kinds = [kind for kind in KINDS.values() if kind.name == name]
    low, high = np.min([kind.low for kind in kinds], axis=0), np.max([kind.high for kind in kinds], axis=0)
    return replace(kinds[0], low=tuple(low.tolist()), high=tuple(high.tolist()))


SMALL: dict[str, Kind] = {name: _category(name) for name in dict.fromkeys(kind.name for kind in KINDS.values())}


def usual(kind: str, rng: np.random.Generator) -> tuple[np.ndarray, int]:
    """Extents (3,) float, metres, and the seed of the program of one of a kind's `FORMS` of usual size."""
    low, high = np.array(KINDS[kind].low), np.array(KINDS[kind].high)
    form = int(rng.random() * FORMS)
    return np.round(low + (high - low) * (form + 0.5) / FORMS, 4), form


def thing(kind: str, size: np.ndarray, rng: np.random.Generator, **form: tuple[float, ...]) -> list[Solid]:
    """The solids of one small thing, about as large as `size` (3,), metres; +Y up, +Z its front, its bottom at 0."""
    return KINDS[kind].program(np.asarray(size, float), rng, **form)


def printed(what: str, form: str, resident: str = "", style: RoomStyle | None = None) -> dict[str, list[str]]:
    """Kind -> names of what is printed on sheets of a form, for somebody who has rows of their own, else for anyone.

    `what`: the word that names begin with. `style`: of a room; its prints are taken alone where there are any.
    """
    fit = {name: row for name, row in PRINTS.items() if name.startswith(f"{what}_") and row["form"] == form}
    own = [name for name, row in fit.items() if resident in row.get("for", ())]
    found: dict[str, list[str]] = {}
    for name in own or (name for name, row in fit.items() if "for" not in row):
        found.setdefault(fit[name].get("kind", name), []).append(name)
    return {kind: names for kind, names in found.items() if style and kind in style.prints} or found


def names_of(what: str, form: str, resident: str = "", style: RoomStyle | None = None) -> list[str]:
    """The names of all kinds that are `printed` so."""
    return [name for names in printed(what, form, resident, style).values() for name in names]


def any_of(what: str, form: str, rng: np.random.Generator) -> str:
    """The name of a row that anybody has."""
    return str(rng.choice(names_of(what, form)))
