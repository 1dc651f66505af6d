"""Licences by their SPDX identifiers, from what catalogues, files and texts beside models call them."""

import re
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

UNKNOWN = "unknown"
NOTICES = ("LICENSE", "LICENCE", "COPYING", "LICENSE-CC0", "README")
MOST = 4000  # characters of a text that are read
PLAIN = (
    (r"\bcc[\s\-_]?0\b|creative commons zero|public domain|\bcc-zero", "CC0-1.0"),
    (r"apache", "Apache-2.0"),
    (r"\bmit\b", "MIT"),
)
CLAUSES = (
    (r"non[\s\-]?commercial|\bnc\b", "NC"),
    (r"no[\s\-]?deriv|\bnd\b", "ND"),
    (r"share[\s\-]?alike|\bsa\b", "SA"),
)


def spdx(text: str) -> str:
    """The SPDX identifier of what somebody calls a licence; the words themselves where they name no known one."""
    line = " ".join(text.split())
    low = line.lower().replace("_", "-")
    if not line:
        return UNKNOWN
    for pattern, name in PLAIN:
        if re.search(pattern, low):
            return name
    if re.search(r"creative ?commons|\bcc[\s\-]|\bcc-?by\b|^by\b|attribution", low):
        version = re.search(r"\b([1-4]\.[05])\b", low)
        number = version[1] if version else ("3.0" if re.search(r"\b3\b", low) else "4.0")
        clauses = [word for pattern, word in CLAUSES if re.search(pattern, low)]
        return "-".join(["CC-BY", *clauses, number])
    return line[:120]


def allowed(licence: str, wanted: Sequence[str]) -> bool:
    """Whether a licence is one of those wanted; `CC-BY` stands for all its versions, never for NC, ND or SA."""
    own = spdx(licence).upper()
    for word in wanted:
        one = spdx(word).upper() if word.upper() != "CC-BY" else "CC-BY"
        bare = re.sub(r"-\d+(\.\d+)?$", "", own)
        if own == one or (not re.search(r"\d", word.replace("CC0", "")) and bare == re.sub(r"-\d+(\.\d+)?$", "", one)):
            return True
    return False


def _beginning(file: Path) -> str:
    with file.open(encoding="utf-8", errors="replace") as opened:
        return opened.read(MOST)


@lru_cache(maxsize=4096)
def licence_beside(folder: Path, top: Path) -> tuple[str, str]:
    """(licence, author) of the text nearest to a model, from its folder up to the library's; ("", "") where none is."""
    while True:
        for name in NOTICES:
            for file in (folder / name, folder / f"{name}.txt", folder / f"{name}.md"):
                try:
                    text = _beginning(file) if file.is_file() else ""
                except OSError:
                    continue
                found = spdx(text) if text else ""
                if found and (name != "README" or found != text.strip()[:120]):
                    author = re.search(r"(?:^|\n)\s*(?:author|by|creator|credit)s?\s*[:=]\s*(.{1,80})", text, re.I)
                    known = found if re.fullmatch(r"[A-Z][A-Za-z0-9.\-]+", found) else found[:80]
                    return known, author[1].strip() if author else ""
        if folder == top or folder.parent == folder:
            return "", ""
        folder = folder.parent
