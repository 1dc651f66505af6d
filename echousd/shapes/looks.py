"""How things look: palettes per style."""

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache

from echomodel.vocabulary import vocabulary
from echousd.shapes.finishes.slots import HARMONIES, SECOND, SLOTS, Color, finish_of, linear, mixed
from echousd.shapes.styles import ROOM_STYLE


@dataclass(frozen=True)
class Look:
    """One UsdPreviewSurface: colours are linear RGB in [0, 1]; the pattern, if there is one, carries the colour.

    `gloss`: what its roughness, or the image of it, is multiplied with. `worn`: share by which wear changes its tone.
    """

    color: Color
    roughness: float = 0.6
    metallic: float = 0.0
    opacity: float = 1.0
    emissive: Color = (0.0, 0.0, 0.0)
    pattern: str = ""
    metres: float = 1.0
    gloss: float = 1.0
    worn: float = 0.0

    @property
    def rough(self) -> float:
        """Its roughness in the mean."""
        return round(min(self.gloss * self.roughness, 1.0), 4)


SHOWN = 6  # harmonies among which a written room or asset lets one choose
GLOW = tuple(round(0.55 * c, 5) for c in linear("ffe2ae"))  # of a lamp's shade


@cache
def look(palette: str, slot: str, variant: int = 0) -> Look:
    """The look of a material slot in a palette; raises KeyError for unknown words.

    `palette`: a word of `HARMONIES`. `slot`: a word of `SLOTS`. `variant`: odd ones take the second wood and cloth of
    the harmony, so that style groups can be told apart.
    """
    harmony, made = HARMONIES[palette], SLOTS[slot]
    word = SECOND.get(made.color, made.color) if variant % 2 else made.color
    color = mixed(harmony.get(word, word), made.mix, made.share)
    emissive = (GLOW[0], GLOW[1], GLOW[2]) if slot == "shade" else (0.0, 0.0, 0.0)
    how = made.metallic, made.opacity, emissive, made.pattern, made.metres
    return Look(color, made.roughness, *how, *finish_of(palette, slot))


def second(seed: int, category: str) -> bool:
    """Whether pieces of a category are of a room's second wood and cloth: a third of what belongs to no set is."""
    return hashlib.blake2b(f"{seed} {category}".encode(), digest_size=4).digest()[0] % 3 == 0


def palette_for(key: str, among: Iterable[str] = HARMONIES) -> str:
    """A palette for a style's name, the same in every run."""
    names = sorted(among)
    return names[int.from_bytes(hashlib.blake2b(key.encode(), digest_size=4).digest(), "big") % len(names)]


def palette_of_room(seed: int, style: str | None = None) -> str:
    """The palette of a room for which nobody chose one, of those that go with its `style`."""
    row = vocabulary().known_style(style)
    return palette_for(f"{ROOM_STYLE} {seed}", row.palettes if row else HARMONIES)


def alternatives(chosen: str, style: str | None = None) -> tuple[str, ...]:
    """`SHOWN` harmonies that a room of a style may be shown in: its own, the style's, then those next in the table."""
    names = list(HARMONIES)
    row, start = vocabulary().known_style(style), names.index(chosen)
    following = (*names[start + 1 :], *names[:start])
    return tuple(dict.fromkeys((chosen, *(row.palettes if row else ()), *following)))[:SHOWN]
