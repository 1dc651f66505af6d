"""Cushions and what somebody left on beds, sofas and armchairs, throws over all of them."""

import numpy as np

from echomodel.dressing import names_of, usual
from echomodel.dressing.textiles import LEAN
from echomodel.late import lates
from echousd.dressing.setting import Setting
from echousd.dressing.soft_tops import Design, Seat, across, corners_of, let_down, lying, put

cushions_on, over_arm = lates("echousd.dressing.seats", "cushions_on", "over_arm")
BURIED = 0.6  # share of its height that what lies on a seat may be in the cloth
WIDE_BED, OVER = 1.3, 0.05  # metres: of a throw's top over a bed, whose cover lies in folds
DRAPED = {"sofa": 0.9, "seat": 0.4}  # shares of sofas and armchairs with a blanket over an arm


def cushions(setting: Setting) -> None:
    """Cushions on all that invites them."""
    for host in setting.of("cushions"):
        rng, seat = setting.rng(host.name, "cushion"), Seat.of(host)
        if seat is not None:
            cushions_on(setting, host, seat, *designs(setting, rng), rng)


def designs(setting: Setting, rng: np.random.Generator) -> tuple[Design, Design]:
    """Two cushions that go together: one plain, one of a print, either of them first; the second often a long one."""
    form = str(rng.choice(("square", "lumbar")))
    kinds = [str(rng.choice(names_of("cushion", form, setting.resident, setting.style) or ["cushion"])), "cushion"]
    made = [(kind, *usual(kind, rng)) for kind in kinds]
    return (made[0], made[1]) if form == "square" and rng.random() < 0.5 else (made[1], made[0])


def bed_cushions(setting: Setting) -> None:
    """Two cushions before the pillows of a wide bed, or one, as on a narrow one."""
    for host in setting.of("bed"):
        rng, seat = setting.rng(host.name, "bed cushion"), Seat.of(host)
        wide, (kind, size, variant) = float(host.size[0]), designs(setting, rng)[int(rng.integers(2))]
        if seat is None:
            continue
        two, size = size[0] < 1.3 * size[1], size + np.array([0.0, 0.0, LEAN * size[1]])
        for side in (-1.0, 1.0) if wide > WIDE_BED and two else (0.0,):
            turn = float(rng.uniform(-0.12, 0.12))
            spot, body = seat.before_pillows(side * 0.21 * wide, size), corners_of(kind, size, variant)
            spot = lying(host, seat, spot, turn, size, body)
            spot = None if spot is None else let_down(host, spot, size)
            put(setting, host, spot, kind, size, turn, variant)


def on_covers(setting: Setting) -> None:
    """What somebody left on the largest bed and on seats, as the story has it."""
    largest = sorted(setting.of("bed"), key=lambda o: -float(o.size[0]))[:1]
    for number, wish in enumerate((*setting.story.beds, *setting.story.seats)):
        for host in setting.of(wish.by) if wish.by else largest:
            rng, seat = setting.rng(host.name, "cover", str(number)), Seat.of(host)
            if seat is None or not setting.has(wish.share, rng):
                continue
            kind, turn = str(rng.choice(wish.of)), float(rng.uniform(-0.5, 0.5))
            size, variant = usual(kind, rng)
            for at in wish.at:
                x, z = (0.0, 0.0) if at == "pillows" else np.array(at) * host.size[[0, 2]] / 2
                spot = seat.before_pillows(x, size) if at == "pillows" else np.array([x, seat.level, z])
                spot = lying(host, seat, spot, turn, size, corners_of(kind, size, variant))
                if spot is not None and wish.by and (seat.below(spot, size) or 0) - spot[1] > BURIED * size[1]:
                    spot = None  # a seat is fuller than its solids
                if put(setting, host, spot, kind, size, turn, variant):
                    break


def throws(setting: Setting) -> None:
    """A blanket across the foot of every bed that lets it lie flat and hang down, over an arm of most other seats."""
    for host in setting.of("bed", "sofa", "cushions"):
        rng, seat, role = setting.rng(host.name, "throw"), Seat.of(host), host.row.role
        if seat is None or (role in DRAPED and not setting.has(DRAPED[role], rng)):
            continue
        if role in DRAPED:
            over = (over_arm(host, seat, side, rng) for side in rng.permutation((-1.0, 1.0)))
        else:
            deep, everywhere = float(np.clip(0.3 * host.size[2], 0.4, 0.75)), np.full(len(seat.x), True)
            depths = (float(host.size[2]) / 2 - back - deep / 2 for back in (0.1, 0.2, 0.3))
            falls = np.full(2, rng.uniform(0.2, 0.32))
            over = (across(host, seat, everywhere, z, deep, falls, OVER, rng) for z in depths)
        setting.put_first(filter(None, over), host=host.name, margin=0.0)
