"""`echousd plugin-path` and `echousd doctor`: where the schema lies, and what is missing on this machine."""

from dataclasses import asdict

import typer

from echousd.cli.options import documented_command
from echousd.cli.output import say_json
from echousd.diagnosis import Diagnosis, diagnose

app = typer.Typer()


@documented_command(app, "plugin-path")
def plugin_path() -> None:
    """Print the folder of the USD schema plugin, for PXR_PLUGINPATH_NAME (does not load USD)."""
    from echousd import plugin

    typer.echo(plugin.plugin_path())


@documented_command(app, "doctor")
def doctor(as_json: bool = False) -> None:
    """Report what EchoUSD finds on this machine and what to do about each gap; exit code 1 if there is one."""
    findings = diagnose()
    healthy = all(diagnosis.state != "gap" for diagnosis in findings)
    if as_json:
        say_json({"ok": healthy, "findings": [asdict(diagnosis) for diagnosis in findings]}, indent=2)
    else:
        _show(findings)
    raise typer.Exit(0 if healthy else 1)


def _show(findings: list[Diagnosis]) -> None:
    from rich.table import Table
    from rich.text import Text

    from echousd.cli.terminal import Terminal

    colours = {"ok": "green", "gap": "red", "optional": "yellow"}
    table = Table(box=None, pad_edge=False, header_style="bold")
    for heading in ("", "state", "found", "remedy"):
        table.add_column(heading, overflow="fold")
    for diagnosis in findings:
        table.add_row(
            diagnosis.name, Text(diagnosis.state, colours[diagnosis.state]), diagnosis.found, diagnosis.remedy
        )
    console = Terminal()
    if not console.is_terminal:
        console.width = 200  # nobody's window: keep paths on one line
    console.print(table)
