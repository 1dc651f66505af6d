"""`echousd texture`: a room as a job for a texturing tool, and what it painted back into the room."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from echousd.cli.options import AsJson, Layout, Wait, documented_command
from echousd.cli.output import counted, say, say_done

if TYPE_CHECKING:
    from echousd.texturing import Job

texture_app = typer.Typer(no_args_is_help=True)
app = typer.Typer()
app.add_typer(texture_app, name="texture", help="To texturing tools (SceneTex, Hunyuan3D-Paint, MVPainter) and back.")


@documented_command(texture_app, "texture export")
def export(
    room: Path, output: Path, tool: str, prompt: str = "", dressing: str = "none", resolution: int | None = None,
    layout: Layout = None, shell: bool | None = None, force: bool = False, json: AsJson = False,
) -> None:  # fmt: skip
    """Write meshes with texture coordinates, cameras, prompts, a script to run the tool, and job.json."""
    from echousd.texturing import export_texture_job

    job = export_texture_job(
        room, output, tool, prompt=prompt, dressing=dressing, resolution=resolution, layout=layout, shell=shell,
        force=force,
    )  # fmt: skip
    content = {"objects": [thing.name for thing in job.objects], "prompt": job.prompt, "left_out": job.left_out}
    lines = [f"job      {output / 'job.json'}", f"objects  {len(job.objects)}, prompt {job.prompt!r}"]
    say_done(json, [output / "job.json"], lines, content)
    if not json:
        _tell(job)


@documented_command(texture_app, "texture import")
def import_(
    room: Path, job: Path, name: str = "", skip: list[str] | None = None, preview: bool = True, force: bool = False,
    wait: Wait = False, json: AsJson = False,
) -> None:  # fmt: skip
    """Bring what a tool painted back as a layer of your own over the room, and a variant of `looks`."""
    from echousd.texturing import import_texture_job

    look = import_texture_job(room, job, name=name, skip=tuple(skip or ()), preview=preview, force=force, wait=wait)
    lines = [
        f"look     {look.layer}",
        f"painted  {counted(len(look.painted), 'object')}; variant {look.name!r} of `looks` on the room",
    ]
    for words, what in ((look.unpainted, "no result"), (look.skipped, "left out")):
        if words:
            lines.append(f"as it was: {', '.join(words)} ({what})")
    content = {"look": look.name, "painted": list(look.painted), "no_result": list(look.unpainted)}
    say_done(json, [look.layer], lines, {**content, "left_out": list(look.skipped)})


def _tell(job: Job) -> None:
    """What will not look as one expects."""
    from echousd.texturing.scenetex import ANCHORED

    for name, why in job.left_out.items():
        say(f"left out {name}: {why}", err=True)
    if not job.one_picture:
        return
    for thing in job.objects:
        if thing.visible is None:
            say('visible texels were not counted, that needs Embree: pip install "echousd[render]"', err=True)
            return
        if thing.visible < ANCHORED:
            what = f"{thing.visible} visible texels, fewer than {ANCHORED}: SceneTex gives it no style of its own"
            say(f"{thing.name}: {what}", err=True)
