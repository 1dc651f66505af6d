"""A library to look through: every model with its picture, by category, as a page and as sheets of pictures."""

from __future__ import annotations

import base64
import html
import io
import re
from collections.abc import Sequence
from pathlib import Path, PurePath

from PIL import Image, ImageDraw

from echomodel.files import whole_file
from echousd.assets.colors import swatches
from echousd.assets.record import AssetRecord
from echousd.assets.shape import SIDE

WIDE = 10  # pictures in a row of a sheet
LABEL = 24  # pixels below a picture
STYLE = """body{font:13px sans-serif;margin:2em}div{display:inline-block;width:11em;vertical-align:top;margin:.4em}
img{width:96px;height:96px}u{display:block;width:96px;height:8px;text-decoration:none}s{display:inline-block;height:8px}
b,i,span{display:block;overflow-wrap:anywhere}i{color:#777}.doubt{background:#fff3d6}"""
OWN = re.compile(r"'[^']*'|\"[^\"]*\"|[/\w.-]*/[/\w.-]+|\d+(\.\d+)?")  # quoted words, paths and numbers in a reason
DOUBT = 0.7  # confidence below which a row is coloured


def write_page(path: Path, records: Sequence[AssetRecord]) -> None:
    """Write an HTML page that stands alone: models by category, those that cannot be used last with the reason."""
    parts = [f"<!doctype html><meta charset=utf-8><title>Models</title><style>{STYLE}</style>"]
    parts.append(f"<h1>{sum(r.usable for r in records)} of {len(records)} models usable</h1>")
    for category, members in grouped(records).items():
        parts.append(f"<h2>{category} ({len(members)})</h2>")
        parts += map(_card, members)
    out = left_out(records)
    if out:
        parts.append(f"<h2>not used ({sum(map(len, out.values()))})</h2>")
    for reason, members in out.items():
        parts.append(f"<details><summary>{len(members)}: {html.escape(reason)}</summary><ul>")
        parts += [f"<li>{html.escape(r.id)}: {html.escape(r.fault)}" for r in members]
        parts.append("</ul></details>")
    with whole_file(path) as beside:
        beside.write_text("\n".join(parts) + "\n", "utf-8")


def left_out(records: Sequence[AssetRecord]) -> dict[str, list[AssetRecord]]:
    """The models that cannot be used by the reason, the commonest first; what is of one model alone is `...` there."""
    found: dict[str, list[AssetRecord]] = {}
    for record in sorted((r for r in records if not r.usable), key=lambda record: record.id):
        where, _, why = record.fault.partition(": ")
        reason = why if why and PurePath(where).name == PurePath(record.id).name else record.fault
        found.setdefault(OWN.sub("...", reason) or "no size or category", []).append(record)
    return dict(sorted(found.items(), key=lambda entry: (-len(entry[1]), entry[0])))


def _card(record: AssetRecord) -> str:
    picture = base64.b64encode(record.thumbnail).decode()
    size = " × ".join(f"{length:.2f}" for length in record.dims)
    doubt = " class=doubt" if min(record.confidence, record.front_confidence) < DOUBT else ""
    told = f"{size} m<br>category {record.confidence:.2f}, front {record.front_confidence:.2f}"
    spots = "".join(f"<s style='background:rgb{rgb};width:{share:.0%}'></s>" for share, rgb in swatches(record.colors))
    whose = html.escape(f"{record.licence} {record.author}")
    return (
        f"<div{doubt}><img src='data:image/png;base64,{picture}'><u>{spots}</u><b>{html.escape(record.name)}</b>"
        f"<span>{html.escape(record.id)}</span><span>{told}</span><i>{whose}</i></div>"
    )


def grouped(records: Sequence[AssetRecord]) -> dict[str, list[AssetRecord]]:
    """The usable models by category, both in alphabetical order."""
    found: dict[str, list[AssetRecord]] = {}
    for record in sorted(records, key=lambda record: (record.category, record.id)):
        if record.usable:
            found.setdefault(record.category, []).append(record)
    return found


def sheet(records: Sequence[AssetRecord], title: str = "") -> Image.Image:
    """One picture of all models of a list, seen from their front right above, with their names."""
    rows = -(-len(records) // WIDE)
    whole = Image.new("RGB", (WIDE * SIDE, 22 + max(rows, 1) * (SIDE + LABEL)), "white")
    draw = ImageDraw.Draw(whole)
    draw.text((4, 4), title, fill="black")
    for number, record in enumerate(records):
        x, y = number % WIDE * SIDE, 22 + number // WIDE * (SIDE + LABEL)
        with Image.open(io.BytesIO(record.thumbnail), formats=("PNG",)) as picture:
            whole.paste(picture.convert("RGB"), (x, y))
        for spot, (_, rgb) in enumerate(swatches(record.colors)):
            draw.rectangle((x + 2 + 9 * spot, y + 2, x + 9 + 9 * spot, y + 9), fill=rgb)
        draw.text((x + 2, y + SIDE), record.name[:16], fill="black")
        draw.text((x + 2, y + SIDE + 11), record.id.rsplit("/", 1)[-1][:16], fill="grey")
    return whole


def write_sheets(folder: Path, records: Sequence[AssetRecord]) -> list[Path]:
    """A PNG for each category in a folder; returns them."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for category, members in grouped(records).items():
        out = io.BytesIO()
        sheet(members, f"{category} ({len(members)}), front to the lower left").save(out, "PNG")
        path = folder / f"{category}.png"
        with whole_file(path) as beside:
            beside.write_bytes(out.getvalue())
        paths.append(path)
    return paths
