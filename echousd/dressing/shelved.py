"""Books that stand on a shelf one by one, in rooms that are dressed in full."""

import numpy as np

from echomodel.boxes2d import turned
from echomodel.dressing.books import book_size, fitting_books
from echousd.dressing.setting import Setting, Thing

VOLUMES = 5  # kinds of single books that a row is of
BETWEEN = 0.002  # metres from book to book


def shelved_books(setting: Setting, row: Thing, rng: np.random.Generator) -> None:
    """Put single books in the place of a row that stands already, each a thing of its own."""
    setting.placed.remove(row)
    wide, tall, deep = (float(v) for v in row.size)
    at, front = -wide / 2, deep / 2
    fitting = fitting_books(tall, deep, VOLUMES, setting.rng("books"))
    while fitting:
        number = int(rng.choice(fitting))
        size = book_size(number)
        if at + size[0] > wide / 2:
            return
        place = np.array([at + size[0] / 2, 0.0, front - size[2] / 2])
        place[::2] = turned(place[::2], row.yaw)
        setting.placed.append(Thing("book", size, row.position + place, row.yaw, row.on, number))
        at += size[0] + BETWEEN
    setting.placed.append(row)
