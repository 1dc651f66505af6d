"""What a row of the vocabulary holds: all that the product knows of a category, a predicate, a room type."""

from dataclasses import dataclass
from typing import Literal

SUPPORTS = ("floor", "table", "wall", "ceiling")
MEASURES = ("place", "size", None)
UNITES = ("style", "shape")
ROLES = ("seat", "sofa", "board", "bed", "storage", "light", "screen", "decor")  # boards are tables and desks
# at a table or desk, before a sofa, at a bed's head, at a foot end, beside, opposite, in the company of a sofa, on top,
# near, flush in a row of fitted units, hung over it
STANCES = ("", "at", "before", "head", "foot", "beside", "opposite", "company", "on", "near", "row", "over")
TASKS = ("", "prepare", "wash", "rinse", "cook", "vent", "cool", "store", "launder")  # of fitted units
# below and around it, on its seat, before it, beside it, over it on the wall, in its room
INVITES = ("rug", "cushions", "pouf", "basket", "picture", "mirror", "clock", "tall_mirror")


@dataclass(frozen=True)
class Category:
    """Everything that the product knows of a fine object category; code asks the row and lists no words of its own.

    Arguments:
        coarse, sgfront: its SG-FRONT classes, simple and fine.
        support: what it rests on, one of `SUPPORTS`.
        role: what people use it for, one of `ROLES`.
        look: how its materials are laid out (`echousd.shapes.looks.BANDS`).
        density: mass over the volume of the whole box, kg/m³ (furniture is mostly hollow).
        kg: (lightest, heaviest) of real ones, with what belongs to them (mattress, books, soil); docs/MASSES.md says
            who weighed them.
        ade20k: its name among the 150 classes of ADE20K.
        colour: of its boxes in pictures of graphs, `#rrggbb`.
        front: one side of it is its front; what has none may stand at any heading.
        wall: it stands with its back to a wall (in at least four of five real rooms).
        carries: a lamp, a television or a plant may stand on its top.
        hangs: it may also hang on a wall.
        solid: its collider may be one hull; everything else has room below or inside that other things need.
        access: metres in front that must stay free, so that it can be opened or used.
        clear: metres before its whole front where somebody stands, washes or kneels and nothing else does.
        task: what is done at it in kitchens and laundries, one of `TASKS`.
        mounted: metres between the floor and its lower edge, of what is fixed to a wall; 0 = as drawn.
        left_free: metres in front that the generator of rooms leaves free, as real rooms do. askew: share of such
            pieces that stand askew in real rooms.
        belongs_to: categories that it attends, the likeliest first.
        stands: how it stands to them, one of `STANCES`.
        admits: (category or role, share): how far such a thing's box may reach into this one's, as a share of that
            thing's smaller horizontal side.
        usual: (low, high) of x, y and z in metres of most such pieces as sold, where the class's statistics mix several
            things or say too little of what people need (seats, room for knees); () = those of what it is `like`.
        sizes: 5th percentile, median and 95th percentile of (x, y, z) as sold, metres, where real rooms tell none.
        bears: metres up to which its top is one plane where things stand on it; higher ones have a mirror, shelves or a
            gable there. 0 = of any height.
        round: it is as wide as deep. aspect: least and greatest width over height, () = any.
        like: the category that weights take it for which do not know it, whose sizes and furniture it borrows where it
            has none of its own, and whose models in libraries may stand for it, "" = its SG-FRONT class.
        top: the category whose small things stand on its top or hang from it (`echousd.dressing`), "" = none.
        invites: small things that go with it, of `INVITES`.
        aliases: what people call it.
    """

    name: str
    coarse: str
    sgfront: str
    support: str
    role: str
    look: str
    density: float
    ade20k: str
    kg: tuple[float, float] = (0.2, 500.0)
    colour: str = "#eeeeee"
    front: bool = True
    wall: bool = False
    carries: bool = False
    hangs: bool = False
    solid: bool = False
    access: float = 0.0
    clear: float = 0.0
    task: str = ""
    mounted: float = 0.0
    left_free: float = 0.0
    askew: float = 0.0
    belongs_to: tuple[str, ...] = ()
    stands: str = ""
    admits: tuple[tuple[str, float], ...] = ()
    usual: tuple[tuple[float, float], ...] = ()
    sizes: tuple[tuple[float, ...], ...] = ()
    bears: float = 0.0
    round: bool = False
    aspect: tuple[float, ...] = ()
    like: str = ""
    top: str = ""
    invites: tuple[str, ...] = ()
    aliases: tuple[str, ...] = ()


@dataclass(frozen=True)
class Predicate:
    """Everything that the product knows of a relation, but for the code of its rule (`echomodel.rules`).

    Arguments:
        id: its number in graphs and room sets: SG-FRONT's own where SG-FRONT has it, the next free one elsewhere.
        sgfront: SG-FRONT's spelling, None where SG-FRONT lacks it.
        inverse: what says the same of the swapped pair, None where nothing does.
        order, rank: the order that it belongs to (left and right share one), and 1 where the subject comes after the
            object, -1 where before.
        kind: its `PredicateKind`.
        measures: what its rule asks of boxes, `place` or `size`; None where it is not measured.
        step: signs (x, z) of the way from the object to the subject, (0, 0) where it names no direction.
        mirror_x, mirror_z: what it becomes where the room is mirrored along an axis, None = itself.
        loss_weight: of its margin in the training loss; what is rare and must hit a small spot needs more than one.
        rests: the subject stands on the object: placing puts it onto the object's top.
        follows: the subject goes along where the object is moved.
        unites: what the two objects have in common, of `style` and `shape`.
        aliases: other words for it.
        swapped: words that mean it with subject and object exchanged; they are named in errors only.
    """

    name: str
    id: int
    kind: str
    sgfront: str | None = None
    inverse: str | None = None
    symmetric: bool = False
    transitive: bool = False
    order: str | None = None
    rank: int = 0
    measures: str | None = None
    step: tuple[int, int] = (0, 0)
    mirror_x: str | None = None
    mirror_z: str | None = None
    loss_weight: float = 1.0
    rests: bool = False
    follows: bool = False
    unites: tuple[str, ...] = ()
    aliases: tuple[str, ...] = ()
    swapped: tuple[str, ...] = ()


@dataclass(frozen=True)
class PredicateKind:
    """Predicates that are drawn alike: the colour `#rrggbb` and the line (`solid`, `dashed`, `dotted`) of arrows."""

    name: str
    colour: str
    line: Literal["solid", "dashed", "dotted"]


@dataclass(frozen=True)
class RoomType:
    """A kind of room.

    Arguments:
        contents: (category, count) of what such a room usually holds.
        scans: what SG-FRONT's scans of such rooms are called before the dash; the first is written.
        signs: categories or coarse classes by which furniture tells such a room; certainty: of the types all of whose
            signs are there, the one with the greatest is meant.
        like: the room type that weights take it for which do not know it, and whose statistics it has where real rooms
            tell none, "" = there is none.
        floor: 5th percentile, median and 95th percentile of the area, square metres, and of the short side, metres,
            where real rooms tell none: what such rooms are planned with, measured on none.
        use: `wet` = its floor is tiled, so are walls that get wet, its windows have blinds; `outdoor` = nothing hangs
            on its walls and windows; "" = neither.
        places: (category, placement): where some of its contents stand in a first graph.
        maybe: (category, share): what such a room of the generator holds besides its contents, now and then.
        cover: share of the floor that furniture covers, median. used: share of the floor that use can take, the rest
            are ways and corners. aspect: long side over short side, median. cut: share of floors with a corner cut off.
        cuts: shares of one, two, three and four corners among the generator's floors that are no rectangle.
        share: of such rooms in a mixed set of generated rooms, 0 = none is drawn.
        zones: (room type, weight): what a large room of this type is besides.
        flooring: the material slot of a third of such floors, "" = all have boards.
        daylight: whether it wants a window. hub: from the greatest, other rooms have their doors in a home; 0 = no.
        aliases: what people call it.
    """

    name: str
    contents: tuple[tuple[str, int], ...]
    scans: tuple[str, ...] = ()
    signs: tuple[str, ...] = ()
    certainty: int = 0
    like: str = ""
    floor: tuple[tuple[float, ...], ...] = ()
    maybe: tuple[tuple[str, float], ...] = ()
    use: Literal["", "wet", "outdoor"] = ""
    places: tuple[tuple[str, str], ...] = ()
    cover: float = 0.35
    used: float = 0.66
    aspect: float = 1.3
    cut: float = 0.12
    cuts: tuple[float, ...] = (0.35, 0.35, 0.2, 0.1)
    share: float = 0.0
    zones: tuple[tuple[str, float], ...] = ()
    flooring: str = ""
    daylight: bool = True
    hub: int = 0
    aliases: tuple[str, ...] = ()


@dataclass(frozen=True)
class HomeRelation:
    """Everything that the product knows of a relation between two rooms of a home.

    Arguments:
        symmetric: whether it says the same of the swapped pair; inverse: what does where it does not itself.
        passes: whether one gets through. wall: metres of wall that the two share at least, 0 = they need not.
        step: signs (x, z) of the way from the object to the subject, (0, 0) where it names no direction.
        aliases: other words for it.
    """

    name: str
    symmetric: bool = False
    inverse: str = ""
    passes: bool = False
    wall: float = 0.0
    step: tuple[int, int] = (0, 0)
    aliases: tuple[str, ...] = ()

    @property
    def compares(self) -> bool:
        """Whether it is about areas, and says nothing of where rooms lie."""
        return not (self.wall or self.symmetric or any(self.step))


@dataclass(frozen=True)
class RoomStyle:
    """What a room, or a set of furniture, of a style that people name keeps to.

    Arguments:
        family: of furniture making. kinds: (part, kinds of it) where the style has others than its family.
        palettes: harmonies. windows, doors, cornices: of the millwork (metres of a cornice's height, 0 = none).
        boxed, sliding, bays: shares of rooms whose curtains hang from behind boards, whose door slides, with a bay.
        french, tall: shares of those whose windows reach down to the floor, or nearly, where nothing is before them.
        covers: what a wall behind a bed or sofa has, "" = nothing. floors: slots of those of wood or the like.
        beams, dados: slots of what lies below the ceiling, and of what covers the foot of all walls, "" = nothing.
        radiators, curtains, shelves: small things that stand under windows, hang before them, and on walls.
        prints: kinds of pictures and names of rugs and cushions (`prints.toml`).
        aliases: other words for it.
    """

    name: str
    family: str
    palettes: tuple[str, ...]
    windows: tuple[str, ...]
    doors: tuple[str, ...]
    covers: tuple[str, ...]
    floors: tuple[str, ...]
    curtains: tuple[str, ...]
    prints: tuple[str, ...]
    cornices: tuple[float, ...] = (0.0,)
    beams: tuple[str, ...] = ("",)
    dados: tuple[str, ...] = ("",)
    boxed: float = 0.0
    bays: float = 0.0
    sliding: float = 0.0
    french: float = 0.0
    tall: float = 0.0
    radiators: tuple[str, ...] = ("panel_radiator",)
    shelves: tuple[str, ...] = ("wall_shelf", "ledge", "box_shelf")
    kinds: tuple[tuple[str, tuple[str, ...]], ...] = ()
    aliases: tuple[str, ...] = ()


@dataclass(frozen=True)
class Placement:
    """Everything that the product knows of a placement, but for the code of its rule (`echomodel.rules.placements`).

    Arguments:
        others: how many other objects it names, 0 or 2.
        aliases: other words for it.
    """

    name: str
    others: int = 0
    aliases: tuple[str, ...] = ()


@dataclass(frozen=True)
class Habit:
    """How objects of some categories stand to the first of `anchors` that the room holds.

    Arguments:
        categories: whose habit it is.
        anchors: categories to relate to, the preferred ones first.
        predicates: what holds between the object and its anchor.
        sides: predicates of which successive objects at one anchor get one each, in turn.
        among: what holds between an object and the first of its kind at the anchor, for pieces that come in sets.
    """

    categories: tuple[str, ...]
    anchors: tuple[str, ...]
    predicates: tuple[str, ...] = ()
    sides: tuple[str, ...] = ()
    among: tuple[str, ...] = ()
