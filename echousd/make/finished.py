"""A finished room: its data, how it is saved and shown, and where it was written."""

import base64
import tempfile
import weakref
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from pxr import Usd

from echomodel.progress import StageTimer
from echousd.room import RoomData

SHOWN = 360  # pixels that a picture in a notebook is wide


class Room(RoomData):
    """A room that can be saved, opened as a stage and looked at; its data are those of `RoomData`."""

    def save(
        self, folder: str | Path, *, force: bool = False, preview: bool | None = None, wait: bool = False,
        store: str | Path | None = None,
    ) -> Path:  # fmt: skip
        """Write the layered room and return the path of its root layer.

        Arguments:
            folder: created if need be, its name names the room; a room of ours in it is regenerated under the name
                that it has. Files that somebody else wrote or edited stay, if need be under another name that a warning
                tells.
            force: also write into a folder that holds other things than a room of ours.
            preview: draw `<name>.png` (needs the extra `render`; left out without it); None = as its options say.
            wait: for another process that writes this folder, instead of raising.
            store: folder where many rooms keep their assets and images once (`echousd.store`), made if need be; None =
                that of the room which is there, "" = none: the room travels alone.

        Raises:
            ValueError: the folder is not ours, is being written by another process, cannot be written, or the disk is
                full; nothing is half-written.
        """
        from echousd.folder.folder import held

        with held(Path(folder), wait=wait):
            return write_room(self, Path(folder), StageTimer(), force=force, store=store, preview=preview).root

    @cached_property
    def stage(self) -> Usd.Stage:
        """The room as a composed stage (written to a temporary folder that lives as long as the room)."""
        folder = tempfile.TemporaryDirectory(prefix="echousd-")
        weakref.finalize(self, folder.cleanup)
        return Usd.Stage.Open(str(self.save(Path(folder.name) / self.name, preview=False)))

    def image(self, *, size: int = 512, view: str = "hero") -> Any:
        """A picture of the room (PIL image); needs the extra `render`."""
        from echousd.draw.rendering import render_stage

        return render_stage(self.stage, view=view, size=size)

    def _repr_html_(self) -> str:
        from echousd.pages import template
        from echousd.textures import encoded

        states, picture = [verdict.state for verdict in self.verdicts], ""
        kept, measured = states.count("kept"), len(states) - states.count("unmeasured")
        with suppress(ValueError):  # without embreex a notebook shows the table alone
            picture = base64.b64encode(encoded(self.image(size=SHOWN))).decode()
        count = f"{len(self.names)} objects, {kept} of {measured} measured relations kept"
        page = template("echousd.make", "room.html.j2")
        return page.render(room=self, count=count, picture=picture, size=SHOWN, zip=zip)

    def __repr__(self) -> str:
        count = f"{len(self.names)} objects, {len(self.verdicts)} relations"
        return f"Room({self.name!r}, {count}, seed {self.provenance.seed})"


@dataclass(frozen=True, eq=False)
class Written:
    """A room and where it lies."""

    room: Room  # what was made
    root: Path  # its root layer, or the flat file
    preview: Path | None = None  # the picture to look at, None = there is none


def write_room(
    room: Room, output: Path, timer: StageTimer, *, flat: bool = False, force: bool = False,
    store: str | Path | None = None, preview: bool | None = None,
) -> Written:  # fmt: skip
    """Write a room as layers with pictures, or as one flat file without; raises ValueError, see `Room.save`."""
    from echousd.make.save import save_layers, write_pictures

    with timer.stage("write"):
        if flat:
            from echousd.make.flat import save_flat

            return Written(room, save_flat(room, output, force=force))
        root = save_layers(room, output, force=force, store=store)
    if not (room.options.preview if preview is None else preview):
        return Written(room, root)
    with timer.stage("preview"):
        drawn = write_pictures(root)
    return Written(room, root, drawn[-1] if drawn else None)
