"""Options that several commands have in the same words, and flags made of the table of a room's options."""

from collections.abc import Callable
from dataclasses import fields
from functools import wraps
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import Annotated, Any, get_type_hints

import typer
from typer.core import TyperCommand, TyperGroup

from echomodel.files import tables

Command = Callable[..., Any]
SAID = tables("words.toml", __file__)  # name of a command -> its row
Room = Annotated[Path, typer.Argument(help="Room (.usda, .usdc, .usd, .usdz) or its folder.")]
Layout = Annotated[int | None, typer.Option(help="Which layout; default: the one it shows.", min=0)]
Written = Annotated[bool, typer.Option("--json", help="Print what was written and seconds as JSON.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print what was found as JSON.")]
Made = Annotated[bool, typer.Option("--json", help="Say what was made as JSON.")]
Force = Annotated[bool, typer.Option("--force", help="Write over what is not ours.")]
Replace = Annotated[bool, typer.Option("--force", help="Replace what is there.")]
ReplacePicture = Annotated[bool, typer.Option("--force", help="Replace a file that is no picture of ours.")]
Wait = Annotated[bool, typer.Option("--wait", help="Wait for another process that writes the folder.", hidden=True)]
Outside = Annotated[
    list[Path] | None,
    typer.Option(
        "--allow-outside",
        help="Folder in which models may lie besides those of the graph and of the index; may be repeated.",
        hidden=True,
    ),
]


def group_of(usual: str) -> type[TyperGroup]:
    """A group of commands of which one may be left out: `echousd batch SOURCES` is `echousd batch run SOURCES`."""

    class WithUsual(TyperGroup):
        """The group."""

        def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
            """The arguments with the command that they leave out."""
            named = not args or args[0] in (*self.commands, *ctx.help_option_names)
            return super().parse_args(ctx, args if named else [usual, *args])

    return WithUsual


LONG = 8  # characters in place of a value; longer ones would leave no room for help


def documented_command(app: typer.Typer, name: str, **more: Any) -> Callable[[Command], Command]:
    """Add a command, called by the last word of its name, with what `words.toml` says of it: examples, and of each
    argument and option that no other command has the help, flags, bounds and the like."""

    def add(command: Command) -> Command:
        hints, row = get_type_hints(command, include_extras=True), SAID[name]
        for kind, make in (("arguments", typer.Argument), ("options", typer.Option)):
            for one, words in row.get(kind, {}).items():
                said = dict(words) if isinstance(words, dict) else {"help": words}
                if "completed" in said:
                    said["autocompletion"] = _beginnings(*said.pop("completed"))
                hints[one] = Annotated[hints[one], make(*said.pop("flags", ()), **said)]
        own = [one for one in signature(command).parameters.values() if one.kind is not Parameter.VAR_KEYWORD]
        command.__signature__ = Signature([one.replace(annotation=hints[one.name]) for one in own])  # type: ignore[attr-defined]
        command.__annotations__ = hints
        app.command(name.split()[-1], epilog=row.get("examples"), **more)(command)
        return command

    return add


def _beginnings(words: str, end: str) -> Callable[[str], list[str]]:
    """What a shell completes: words of the vocabulary, with what comes after them."""

    def found(incomplete: str) -> list[str]:
        from echomodel.vocabulary import vocabulary

        return [one.name + end for one in getattr(vocabulary(), words) if one.name.startswith(incomplete)]

    return found


def add_room_command(
    app: typer.Typer, name: str, command: Command, *, edits: bool = False, asks: bool = False, batch: bool = False
) -> None:
    """Add a command that takes a room's options: in place of its `**changes` those of the table that are used.

    Arguments:
        edits: only what an edit may set. asks: and what it changes (`EditRequest`).
        batch: the table of a batch, whose seed is not among the rooms'.
    """
    own = [one for one in signature(command).parameters.values() if one.kind is not Parameter.VAR_KEYWORD]
    used: dict[str, Any] = {}

    class WithFlags(TyperCommand):
        """The command, which reads the table when it is called: `echousd --help` must not wait for it."""

        flags: frozenset[str] = frozenset()

        def make_context(self, *values: Any, **extra: Any) -> Any:
            if not self.flags:
                found = _flags(edits=edits, asks=asks, batch=batch)
                self.flags = frozenset(one.name for one in found)
                self.params[len(own) : len(own)] = click_options(*found)
            return super().make_context(*values, **extra)

        def invoke(self, ctx: Any) -> Any:
            used.clear()
            used.update({name: ctx.params.pop(name) for name in [*ctx.params] if name in self.flags})
            return super().invoke(ctx)

    @documented_command(app, name, cls=WithFlags)
    @wraps(command)
    def call(**values: Any) -> Any:
        return command(**values, **{name: value for name, value in used.items() if value is not None})


def click_options(*flags: Parameter) -> list[Any]:
    """Flags as typer makes them of a function's arguments."""

    def holder(**_: Any) -> None: ...

    holder.__signature__ = Signature(flags)  # type: ignore[attr-defined]
    holder.__annotations__ = {flag.name: flag.annotation for flag in flags}
    alone = typer.Typer(add_completion=False)
    alone.command()(holder)
    return list(typer.main.get_command(alone).params)


def _flags(*, edits: bool, asks: bool, batch: bool) -> list[Parameter]:
    from echousd.options import GROUPS, OF_NEW, RoomOptions

    table = RoomOptions
    if batch:
        from echousd.batches.options import BatchOptions as table
    rows: dict[str, Any] = dict(table.model_fields)
    chosen = OF_NEW if edits else [name for name in rows if not (batch and name == "seed")]
    ordered = sorted(chosen, key=lambda name: GROUPS.index(rows[name].json_schema_extra["group"]))
    wishes = []
    if asks:
        from echousd.graph.changes import EditRequest

        for one in fields(EditRequest):
            kind: Any = Annotated[
                list[str] | None, typer.Option(help=one.metadata["help"], metavar=one.metadata["form"])
            ]
            wishes.append(Parameter(one.name, Parameter.KEYWORD_ONLY, default=None, annotation=kind))
    return [*wishes, *(_flag(name, rows[name]) for name in ordered)]


def _flag(name: str, row: Any) -> Parameter:
    """The flag of a row: None where it is not given, so that a file's value or the default stands."""
    from echousd.options import words_of

    kind = next(kind for kind in (bool, int, float, str) if _is(row.annotation, kind))
    words, extra = words_of(row), row.json_schema_extra
    word, text = f"--{extra['flag'] or name.replace('_', '-')}", f"{row.description[0].upper()}{row.description[1:]}"
    if kind is bool and row.default:
        word += f"/--no-{name.replace('_', '-')}"
    if len(words) > LONG:
        text, words = f"{text}: {words.replace('|', ', ')}", "word"
    default = f" ({row.default})" if row.default not in (None, "", True, False) else ""
    option = typer.Option(
        word, help=f"{text}{default}.", metavar=words or None,
        hidden=not extra["everyday"], rich_help_panel=None if extra["everyday"] else extra["group"],
    )  # fmt: skip
    return Parameter(name, Parameter.KEYWORD_ONLY, default=None, annotation=Annotated[kind | None, option])


def _is(annotation: Any, kind: type) -> bool:
    """Whether a field holds values of a kind, alone or among others (a Literal's words are texts)."""
    inner = getattr(annotation, "__args__", ())
    return annotation is kind or isinstance(annotation, kind) or any(_is(one, kind) for one in inner)
