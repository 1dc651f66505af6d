"""Makes docs/RULES.md from the table of terms.

python docs/make_rules.py
"""

from pathlib import Path

from echomodel.objective import KINDS, TERMS, WALKED, Term

PAGE = Path(__file__).with_name("RULES.md")
KIND = {
    "relations": "What the graph states, wherever it states it.",
    "physics": "What no room breaks.",
    "living": "What a person expects where the graph is silent.",
    "composition": "What makes a room whole.",
}
UNITS = {"m": "metres", "rad": "radians", "share": "a share"}


def page() -> str:
    """The whole page as Markdown."""
    lines = [
        "# Rules", "",
        "Made by `python docs/make_rules.py` from `echomodel.objective`, the one table by which rooms are searched,",
        "learned, placed, checked and explained. In a conflict the kinds count in this order. A term is kept where",
        "its margin is not negative; a search asks for its slack on top (in brackets: once nothing is wrong any",
        "longer), and pays 2 for a broken term and its weight for each unit that is missed.", "",
        "![Rooms that break a term each](rules.png)", "",
        "*A room from above for each term that breaks it; what is at fault red, what it is about orange, a thick side",
        "the front; `python docs/make_rule_pictures.py`. Terms of fitted kitchens and baths are missing, as the room",
        "generator has none.*",
    ]  # fmt: skip
    for kind in KINDS:
        rows = [term for term in (*TERMS, *WALKED) if term.kind == kind]
        if rows:
            lines += ["", f"## {kind.capitalize()}", "", KIND[kind], ""]
            lines += ["| term | what is expected | margin in | slack | weight | where its numbers come from |"]
            lines += ["|---|---|---|---|---|---|", *map(_row, rows)]
    return "\n".join(lines) + "\n"


def _row(term: Term) -> str:
    says = "; ".join(f"“{sentence}”" for sentence in term.says) if term.kind != "relations" else ""
    means = f"{term.means.rstrip('.')}. {says}".strip()
    slack = f"{term.slack:g} ({term.ease:g})" if term.ease else f"{term.slack:g}"
    return f"| {term.name} | {means} | {UNITS[term.unit]} | {slack} | {term.weight:g} | {term.source} |"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
