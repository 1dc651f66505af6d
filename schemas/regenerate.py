"""Regenerate the plugin in resources/ from schema.usda: `python -m echousd.schemas.regenerate` (needs jinja2)."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

from echomodel.vocabulary import vocabulary

SCHEMA = Path(__file__).with_name("schema.usda")
RESOURCES = SCHEMA.parent / "resources"
FILES = ("generatedSchema.usda", "plugInfo.json")


def with_vocabulary(schema: str) -> str:
    """The text of schema.usda with the room types, predicates and placements that the vocabulary has."""
    words = vocabulary()
    alone = [row for row in words.placements if not row.others]
    for name, rows in (
        ("echo:roomType", words.room_types),
        ("echo:roomStyle", words.styles),
        ("echo:predicate", (*words.predicates, *words.home_relations)),
        ("echo:place", alone),
    ):
        tokens = ", ".join(f'"{row.name}"' for row in rows)
        schema, found = re.subn(rf"(token {name} .*?allowedTokens = )\[[^]]*\]", rf"\1[{tokens}]", schema, flags=re.S)
        if found != 1:
            raise RuntimeError(f"{SCHEMA}: {name} has allowedTokens {found} times, expected once")
    return schema


def regenerate(target: Path = RESOURCES) -> None:
    """Write generatedSchema.usda and plugInfo.json of schema.usda to the folder `target`.

    The tokens of room types, styles, predicates and placements in schema.usda itself are brought up to date before.

    Raises RuntimeError with usdGenSchema's own words where it fails (for one, when jinja2 is not installed).
    """
    target.mkdir(parents=True, exist_ok=True)
    text = SCHEMA.read_text("utf-8")
    if with_vocabulary(text) != text:
        SCHEMA.write_text(with_vocabulary(text), "utf-8")
    command = [sys.executable, "-m", "pxr.Usd.usdGenSchema", str(SCHEMA), str(target)]
    # The installed plugin must not be loaded while it is generated anew.
    environment = {key: text for key, text in os.environ.items() if key != "PXR_PLUGINPATH_NAME"}
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    if done.returncode:
        raise RuntimeError(f"usdGenSchema failed on {SCHEMA}:\n{done.stdout}{done.stderr}")
    # A codeless plugin has no library and lies beside its resources: fill in what a C++ build would.
    info = target / "plugInfo.json"
    text = info.read_text("utf-8")
    for placeholder, value in (("LIBRARY_PATH", ""), ("RESOURCE_PATH", "resources"), ("ROOT", "..")):
        text = text.replace(f"@PLUG_INFO_{placeholder}@", value)
    info.write_text(text, "utf-8")


if __name__ == "__main__":
    regenerate()
