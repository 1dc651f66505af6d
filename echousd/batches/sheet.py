"""The contact sheet of a run: one HTML page without external links, broken rooms first, to be filtered by type."""

from __future__ import annotations

import html
from collections.abc import Collection, Iterable
from pathlib import Path
from typing import Any

from echomodel.files import whole_file

SHEET = "index.html"
STYLE = """body{font:14px system-ui,sans-serif;margin:1.5rem;background:#fafafa;color:#222}
main{display:grid;grid-template-columns:repeat(auto-fill,minmax(210px,1fr));gap:.8rem}
article{background:#fff;border:1px solid #ddd;border-radius:6px;padding:.5rem}
article.bad{border-color:#c33}img{width:100%;aspect-ratio:1;object-fit:cover;background:#eee}
h2{font-size:.9rem;margin:.3rem 0;overflow-wrap:anywhere}p{margin:.15rem 0;color:#555}.fault{color:#b22}"""
SCRIPT = """const type=document.getElementById('type'),bad=document.getElementById('bad');
function show(){for(const a of document.querySelectorAll('article'))
a.hidden=(type.value&&a.dataset.type!==type.value)||(bad.checked&&!a.classList.contains('bad'))}
type.onchange=bad.onchange=show"""


def write_sheet(
    folder: Path, rows: Iterable[dict[str, Any]], title: str, pictures: Collection[str] | None = None
) -> Path:
    """Write `index.html`; its pictures are those of the rooms, by relative paths.

    Arguments:
        rows: of the manifest. title: what stands above. pictures: paths of those that there are, None = look.
    """
    cards: list[tuple[int, str, str]] = []
    kinds = set()
    for row in rows:
        kinds.add(row["type"])
        worst, card = _card(row, folder, pictures)
        cards.append((worst, row["id"], card))
    cards.sort(key=lambda card: (-card[0], card[1]))
    options = "".join(f"<option>{html.escape(kind)}</option>" for kind in sorted(kinds - {""}))
    with whole_file(folder / SHEET) as beside, beside.open("w", encoding="utf-8") as file:
        file.write(
            f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{html.escape(title)}</title>'
            f"<style>{STYLE}</style><h1>{html.escape(title)}</h1><p><label>Type <select id=type>"
            f"<option value=''>all</option>{options}</select></label> "
            "<label><input type=checkbox id=bad> only rooms with faults</label></p><main>\n"
        )
        file.writelines(f"{card}\n" for _, _, card in cards)
        file.write(f"</main><script>{SCRIPT}</script></html>\n")
    return folder / SHEET


def _card(row: dict[str, Any], folder: Path, pictures: Collection[str] | None) -> tuple[int, str]:
    """How bad a room is, and its card."""
    told = []
    if row["state"] != "done":
        told = [row["error"] or "not made yet"]
    else:
        missed = row["relations_asked"] - row["relations_kept"]
        told += [f"relations not kept: {missed}"] * bool(missed)
        told += [f"collisions: {row['collisions']}"] * bool(row["collisions"])
        told += ["fails echousd check"] * (not row["check"])
        told += [str(text) for text in row["check_errors"]]
        told += row["living_faults"]
    worst = (1000 if row["state"] != "done" else 100 * (not row["check"])) + len(told) * (row["state"] == "done")
    picture = Path(row["root"]).with_suffix(".png") if row["root"] else None
    image = ""
    if picture and ((folder / picture).is_file() if pictures is None else picture.as_posix() in pictures):
        image = f'<img loading="lazy" alt="" src="{html.escape(picture.as_posix())}">'
    kept = f"{row['objects']} objects, {row['relations_kept']} of {row['relations_asked']} relations"
    faults = "".join(f'<p class="fault">{html.escape(text[:300])}</p>' for text in told)
    name = html.escape(row["id"])
    heading = f'<a href="{html.escape(row["root"])}">{name}</a>' if row["root"] else name
    kind = html.escape(row["type"])
    return worst, (
        f'<article class="{"bad" if told else ""}" data-type="{kind}">{image}<h2>{heading}</h2>'
        f"<p>{kind}, seed {row['seed']}</p><p>{kept if row['root'] else ''}</p>{faults}</article>"
    )
