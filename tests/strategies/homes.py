"""Graphs of homes for tests: random ones, and rooms that are made fast in the test's own process."""

from hypothesis import strategies as st
from inline_batches import Inline

from echousd.home.graph import HomeGraph

QUICK = ("--shapes", "boxes", "--dress", "none", "--no-preview", "--drafts", "1", "--steps", "2")
OTHERS = ("bedroom", "study", "childrens_room", "bathroom", "utility_room", "balcony", "dining_room")


@st.composite
def homes(draw, most=8):
    """3 to `most` rooms that are all reached, most from a hall, and up to two relations of other kinds."""
    count = draw(st.integers(3, most))
    types = ["hall", "living", "kitchen", "bathroom", *draw(st.lists(st.sampled_from(OTHERS), min_size=4, max_size=4))]
    again = [types[:i].count(name) for i, name in enumerate(types)]
    names = [f"{name}_{number + 1}" if number else name for name, number in zip(types, again, strict=True)]
    names, said, joined = names[:count], [], set()
    for i in range(1, count):
        other = names[draw(st.integers(0, i - 1)) if draw(st.booleans()) else 0]
        other = "hall" if other.startswith("balcony") else other
        said.append(f"{other} {draw(st.sampled_from(('door', 'door', 'open_to')))} {names[i]}")
        joined.add(frozenset((other, names[i])))
    for _ in range(draw(st.integers(0, 2))):
        one, other = draw(st.permutations(names))[:2]
        if frozenset((one, other)) not in joined:
            joined.add(frozenset((one, other)))
            said.append(
                f"{one} {draw(st.sampled_from(('adjacent', 'not_adjacent', 'north_of', 'larger_than')))} {other}"
            )
    return HomeGraph.from_words(", ".join(said))


def inline(monkeypatch):
    """Have the rooms of homes made in this process."""
    monkeypatch.setattr("echousd.home.assemble.LocalWorkers", lambda *_, **__: Inline())
