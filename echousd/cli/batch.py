"""`echousd batch`: many rooms from graphs; `status` and `verify` of such a run."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from echousd.cli.options import AsJson, Outside, add_room_command, documented_command, group_of
from echousd.cli.output import one_line, say, say_error, say_found, say_json

if TYPE_CHECKING:
    from echousd.batches.batch import BatchProgress


batch_app = typer.Typer(cls=group_of("run"), no_args_is_help=True)
app = typer.Typer()
app.add_typer(batch_app, name="batch", help="Many rooms: a plan, workers, a journal, a manifest.")


def run(
    sources: list[str] | None = None, output: Path = Path("batch"), sample: str = "", count: int | None = None,
    seed: int | None = None, workers: int | None = None, shard: str = "0/1", resume: bool = False,
    max_failures: int | None = None, timeout: float | None = None, until: str = "", memory: int = 4096,
    more: list[str] | None = None, ray: str = "", webdataset: bool = False, json: bool = False,
    outside: Outside = None, **changes: Any,
) -> None:  # fmt: skip
    """Make many rooms, each whole or not at all; end it, go on with --resume, on as many machines as there are."""
    from echousd.batches.batch import RunOptions, run_batch
    from echousd.batches.options import parse_options, parse_sample, read_toml, request_of
    from echousd.batches.plan import load_plan
    from echousd.batches.verify import finish

    words = list(sources or [])
    files = [word for word in words if word.endswith(".toml")]
    raw = read_toml(Path(files[0])) if files else {}
    if len(files) > 1:
        raise ValueError(f"{len(files)} .toml files, allowed: one")
    raw["sources"] = [*raw.get("sources", []), *(word for word in words if word not in files)]
    raw["sample"] = {**raw.get("sample", {}), **parse_sample(sample)}
    raw |= {key: value for key, value in (("count", count), ("seed", seed)) if value is not None}
    if "assets" in changes:
        changes["assets"] = str(Path(changes["assets"]).absolute())
    raw["options"] = {**raw.get("options", {}), **parse_options(more or []), **changes}
    again = resume and raw == {"sources": [], "sample": {}, "options": {}}
    there = load_plan(output) if again else None
    request = there.request if there else request_of(raw, files[0] if files else "batch")
    with _shown(json) as tell:
        how = RunOptions(
            workers=workers, shard=_shard(shard), resume=resume, max_failures=max_failures, timeout=timeout,
            until=_clock(until), memory=memory, ray=ray, progress=tell, outside=tuple(map(str, outside or ())),
        )  # fmt: skip
        result = run_batch(request, output, how, there)
    found = finish(output, webdataset=webdataset)
    say(f"rooms    {result.done} of {result.rooms}, {result.failed} failed, in {result.seconds:.0f} s", err=json)
    sheet = output / "index.html"
    say(f"run      {output}: {found['done']} of {found['rooms']} rooms; see {sheet}", err=json)
    if result.stopped:
        say(f"stopped  {result.stopped}", err=json)
    if result.failed or result.stopped:
        raise typer.Exit(1)


add_room_command(batch_app, "batch run", run, batch=True)


@documented_command(batch_app, "batch status")
def status(folder: Path, json: bool = False) -> None:
    """How far a run is, of all its shards."""
    from echousd.batches.plan import load_plan
    from echousd.batches.verify import manifest_rows, summary

    found = summary(manifest_rows(load_plan(folder), folder))
    line = f"rooms    {found['done']} of {found['rooms']} done, {found['failed']} failed, {found['missing']} to go"
    say_found(json, found, [line, *(f"failed   {times} x {one_line(why)}" for why, times in found["errors"].items())])


@documented_command(batch_app, "batch verify")
def verify(folder: Path, check: bool = False, json: AsJson = False) -> None:
    """Compare every room with the journal: there, whole, unchanged. Exit code 1 where one is not."""
    from echousd.batches.verify import verify as found_wrong

    wrong = []
    for room, problem in found_wrong(folder, check=check):
        wrong.append({"room": room, "problem": problem})
        if not json:
            say(f"{room}: {one_line(problem)}")
    good = [] if wrong else ["every room is there and as it was made"]
    say_found(json, {"ok": not wrong, "wrong": wrong}, good, ok=not wrong)


def _shard(text: str) -> tuple[int, int]:
    found = re.fullmatch(r"(\d{1,6})/(\d{1,6})", text, re.ASCII)
    if not found:
        raise ValueError(f"--shard is {text!r}, allowed: i/n, such as 0/8")
    return int(found[1]), int(found[2])


def _clock(text: str) -> float | None:
    """The next time that a clock shows `text`, as `time.time()` counts."""
    if not text:
        return None
    found = re.fullmatch(r"(\d{1,2}):(\d\d)", text, re.ASCII)
    if not found or int(found[1]) > 23 or int(found[2]) > 59:
        raise ValueError(f"--until is {text!r}, allowed: a time, such as 06:30")
    now = time.localtime()
    seconds = (int(found[1]) - now.tm_hour) * 3600 + (int(found[2]) - now.tm_min) * 60 - now.tm_sec
    return time.time() + (seconds if seconds > 0 else seconds + 24 * 3600)


@contextmanager
def _shown(json: bool) -> Iterator[Callable[[BatchProgress], None]]:
    """A live line on a terminal, plain lines in a log (a failure at once, else every 30 s), JSON lines if wanted."""
    from echousd.cli.terminal import Terminal

    console = Terminal(stderr=True)
    last: dict[str, Any] = {"room": "", "when": 0.0}

    def line(progress: BatchProgress) -> str:
        left = "" if progress.left is None else f", {progress.left / 60:.0f} min left"
        return (
            f"{progress.done} of {progress.total} rooms, {progress.rate:.2f} a second{left}, "
            f"{progress.failed} failed, {progress.megabytes:.0f} MiB"
        )

    def tell(progress: BatchProgress) -> None:
        new = progress.room != last["room"]
        last["room"] = progress.room
        if json and new:
            fields = {"room": progress.room, "error": progress.error, "done": progress.done, "failed": progress.failed}
            rest = {"total": progress.total, "seconds": round(progress.seconds, 1), "rate": round(progress.rate, 3)}
            say_json({**fields, **rest, "megabytes": round(progress.megabytes)})
        elif new and progress.error:
            say_error(f"failed   {progress.room}: {one_line(progress.error)}")
        if live is not None:
            live.update(line(progress))
        elif not json and time.monotonic() - last["when"] > 30:
            last["when"] = time.monotonic()
            say(line(progress), err=True)

    live: Any = None
    if console.is_terminal and not console.quiet and not json:
        with console.status("starting") as live:
            yield tell
        return
    yield tell
