"""A home as a whole: what stands in a door between two rooms is told, and what leaves a way is not."""

import numpy as np
import pytest
import shapely

from echousd.home.check import ROBOT, _blocked, walked
from echousd.home.graph import HomeGraph
from echousd.home.plan import HomePlan, doorways, plan_home


@pytest.fixture(scope="module", params=["door", "open_to"])
def plan(request) -> HomePlan:
    return plan_home(HomeGraph.from_words(f"living {request.param} kitchen", area=40))


def ground(plan, *things):
    shapes = [shapely.Polygon(floor) for floor in plan.floors.values()]
    whole = shapely.union_all([*shapes, *(shapely.box(*c.ravel()).buffer(0.02) for *_, c in doorways(plan))])
    return whole.difference(shapely.union_all(things) if things else shapely.Polygon()).buffer(-ROBOT)


def test_one_gets_everywhere_but_behind_what_fills_the_way(plan):
    assert all(share == pytest.approx(1.0) for share in walked(plan, ground(plan)).values())
    ((*_, corners),) = doorways(plan)
    reached = walked(plan, ground(plan, shapely.box(*corners.ravel()).buffer(0.1)))
    assert sorted(reached.values()) == [0.0, pytest.approx(1.0)]


def test_a_blocked_way_is_told(plan):
    ((_, opening, corners),) = doorways(plan)
    assert list(_blocked(plan, ground(plan))) == []
    doorway = shapely.box(*corners.ravel())
    middle = doorway.centroid
    for away in (-0.4, 0.4):  # a cupboard before the whole way, in either room
        along = np.ptp(corners, 0).argmin()
        moved = shapely.affinity.translate(doorway, *(away if axis == along else 0.0 for axis in (0, 1)))
        (said,) = _blocked(plan, ground(plan, moved))
        assert said.startswith(f"{opening.kind} between")
        assert "furniture leaves no 0.3 m to get through" in said
    post = middle.buffer(0.1)
    told = list(_blocked(plan, ground(plan, post)))
    assert bool(told) == (opening.width < 0.2 + 4 * ROBOT), "a robot goes round a post in a wide passage"
