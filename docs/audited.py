"""What an audit found, in words: pip-audit calls it a success where its database could not be asked at all."""

from __future__ import annotations

import json
import sys
from pathlib import Path


def said(found: list[dict]) -> tuple[str, int]:
    """What to tell of the dependencies of pip-audit's report, and the exit code: 1 for faults, 2 for an audit of less.

    Arguments:
        found: entries with `name`, `version` and `vulns`, or `name` and `skip_reason`.
    """
    wrong = [f"{one['name']} {one['version']}: {fault['id']}" for one in found for fault in one.get("vulns", ())]
    unasked = [one["name"] for one in found if "skip_reason" in one]
    lines = [*wrong, f"audit: {len(found) - len(unasked)} of {len(found)} audited, {len(wrong)} known faults"]
    if unasked:
        lines.append(f"audit: the database of known faults could not be asked about {', '.join(unasked)}")
    return "\n".join(lines), 1 if wrong else 2 if unasked or not found else 0


if __name__ == "__main__":
    file = Path(sys.argv[1])
    text, code = said(json.loads(file.read_text("utf-8"))["dependencies"] if file.is_file() else [])
    print(text)  # noqa: T201
    raise SystemExit(code)
