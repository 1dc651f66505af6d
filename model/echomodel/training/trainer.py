"""The trainer: one loop for all stages, seeded per step so that a resumed run continues bit for bit."""

import copy
import csv
import json
import math
import time
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from typing import Any, Protocol

import torch
from safetensors import SafetensorError, safe_open
from torch import Tensor, nn

from echomodel.config import to_json
from echomodel.files import raising, whole_file
from echomodel.tensors import write_tensors
from echomodel.training.recipe import Recipe

# Fields of a recipe that may change on the way: length, rates and weights, files, and what the machine offers.
MAY_CHANGE = {
    "steps", "data", "start", "warm", "optimizer", "relation_weight", "measure_weight",
    "physics_weight", "drawn_weight", "validate_every", "save_every", "log_every", "threads", "workers", "compiled",
    "precision", "nodes", "scenes", "shapes_per_batch",
}  # fmt: skip
Report = Callable[[int, dict[str, float]], None]
Trainable = Any  # a module that names its `parts`, gives their parameters and writes them, as `CompactModel` does


class TrainingStage(Protocol):
    """What a stage brings: parts that it trains, parts that its weights file holds, loss and validation."""

    @property
    def trained(self) -> tuple[str, ...]: ...

    @property
    def saved(self) -> tuple[str, ...]: ...

    def loss(self, model: Any, generator: torch.Generator) -> tuple[Tensor, dict[str, Tensor]]: ...

    def validate(self, model: Any) -> dict[str, float]: ...


class Trainer:
    """Trains the stage's parts of a model and keeps checkpoint, log, curves and averaged weights in a folder.

    Arguments:
        recipe: what to do.
        model: the model, initialised; what of it asks for no gradient stays as it is.
        stage: losses and validation.
        folder: where checkpoint.safetensors, weights.safetensors, log.csv and curves.png go.
        resume: continue from the folder's checkpoint.
        report: called with (step, values) whenever something is logged.

    Raises ValueError for `resume` without a checkpoint, or one of a recipe that differs in more than `MAY_CHANGE`;
    names the fields.
    """

    def __init__(
        self, recipe: Recipe, model: Trainable, stage: TrainingStage, folder: Path, *, resume: bool = False,
        report: Report | None = None,
    ) -> None:  # fmt: skip
        self.recipe, self.model, self.stage, self.folder = recipe, model, stage, folder
        self.report = report or (lambda step, values: None)
        for name in model.parts:
            for parameter in model.part_parameters(name):
                parameter.requires_grad_(parameter.requires_grad and name in stage.trained)
        self.device = next(model.parameters()).device
        self.average = copy.deepcopy(model).requires_grad_(False).eval()
        self.trained = {name: p for name, p in model.named_parameters() if p.requires_grad}
        decayed = [p for p in self.trained.values() if p.ndim > 1]
        others = [p for p in self.trained.values() if p.ndim <= 1]
        settings = recipe.optimizer
        self.optimizer = torch.optim.AdamW(
            [{"params": decayed, "weight_decay": settings.decay}, {"params": others, "weight_decay": 0.0}],
            lr=settings.rate,
            fused=self.device.type in ("cpu", "cuda"),
        )
        self.step = 0
        if resume:
            self._load()

    def run(self, until: int | None = None, seconds: float | None = None) -> int:
        """Train to the recipe's last step, or to step `until`, or for so many seconds; returns the step reached."""
        recipe, last = self.recipe, self.recipe.steps if until is None else min(until, self.recipe.steps)
        self.folder.mkdir(parents=True, exist_ok=True)
        log = self.folder / "log.csv"
        rows = [row for row in read_log(log) if row[0] <= self.step]  # a run that was cut off may have logged more
        with log.open("w", newline="") as handle:
            csv.writer(handle).writerows([("step", "name", "value"), *rows])
        started = marked = time.monotonic()
        sums, logged = dict[str, float](), self.step
        self.model.train()
        while self.step < last and (seconds is None or time.monotonic() - started < seconds):
            for name, value in self._train_step().items():
                sums[name] = sums.get(name, 0.0) + value
            if self.step % recipe.log_every == 0:
                count = self.step - logged
                means = {name: value / count for name, value in sums.items()}
                means["steps_per_second"] = count / (time.monotonic() - marked)
                write_log(log, self.step, means)
                self.report(self.step, means)
                marked, sums, logged = time.monotonic(), {}, self.step
            if self.step % recipe.validate_every == 0 or self.step == last:
                scores = self.stage.validate(self.average)
                write_log(log, self.step, scores)
                self.report(self.step, scores)
                plot_log(log, self.folder / "curves.png")
            if self.step % recipe.save_every == 0 or self.step == last:
                self.save()
        self.save()
        return self.step

    def _train_step(self) -> dict[str, float]:
        settings = self.recipe.optimizer
        for group in self.optimizer.param_groups:
            group["lr"] = settings.rate_at(self.step, self.recipe.steps)
        generator = step_generator(self.recipe.seed, self.step)
        half = self.recipe.precision == "bfloat16"
        with torch.autocast(self.device.type, torch.bfloat16) if half else nullcontext():
            loss, parts = self.stage.loss(self.model, generator)
        loss.backward()
        norm = nn.utils.clip_grad_norm_(list(self.trained.values()), settings.clip)
        if not torch.isfinite(norm):
            raise FloatingPointError(f"step {self.step}: gradient norm is {float(norm)}, loss {float(loss)}")
        self.optimizer.step()
        self.optimizer.zero_grad(set_to_none=True)
        self.step += 1
        # a young average would remember the initial weights for too long
        decay = min(settings.average, (1 + self.step) / (10 + self.step))
        averaged = dict(self.average.named_parameters())
        with torch.no_grad():
            torch._foreach_lerp_([averaged[name] for name in self.trained], list(self.trained.values()), 1 - decay)
            for name, buffer in self.model.named_buffers():
                self.average.get_buffer(name).copy_(buffer)
        return {"loss": loss.item(), "norm": norm.item(), **{name: value.item() for name, value in parts.items()}}

    def save(self) -> None:
        """Write checkpoint and averaged weights (each beside its place, then renamed)."""
        tensors = {f"model.{key}": value for key, value in self.model.state_dict().items()}
        averaged = dict(self.average.named_parameters())
        for name, parameter in self.trained.items():
            tensors[f"average.{name}"] = averaged[name]
            for key, value in self.optimizer.state[parameter].items():
                tensors[f"optimizer.{key}.{name}"] = torch.as_tensor(value)
        metadata = {"step": str(self.step), "recipe": to_json(self.recipe)}
        copies = {key: value.detach().cpu().contiguous().clone() for key, value in tensors.items()}
        write_tensors(self.folder / "checkpoint.safetensors", copies, metadata)
        self.average.write(self.folder / "weights.safetensors", self.stage.saved)

    def _load(self) -> None:
        path = self.folder / "checkpoint.safetensors"
        if not path.exists():
            raise ValueError(f"{path}: no checkpoint to resume from")
        try:
            with safe_open(path, "pt") as handle:
                metadata = handle.metadata()
                tensors = {key: handle.get_tensor(key) for key in handle.keys()}  # noqa: SIM118
            step, recipe = int(metadata["step"]), dict(json.loads(metadata["recipe"]))
        except (SafetensorError, OSError, KeyError, TypeError, ValueError, RecursionError) as error:
            raise ValueError(f"{path}: not a checkpoint of a training ({error})") from None
        other = changed_fields(recipe, json.loads(to_json(self.recipe)))
        if other:
            message = "; ".join(f"{name} was {was!r}, is {now!r}" for name, was, now in other)
            raise ValueError(f"{path}: is a checkpoint of another recipe ({message})")
        try:
            state = {key[6:]: value for key, value in tensors.items() if key.startswith("model.")}
            self.model.load_state_dict(state)
            self._continue_from(tensors)
        except (RuntimeError, KeyError) as error:
            message = str(error).splitlines()[:2][-1].strip()
            raise ValueError(f"{path}: does not fit the recipe's model: {message}") from None
        self.step = step

    def _continue_from(self, tensors: dict[str, torch.Tensor]) -> None:
        averaged = dict(self.average.named_parameters())
        with torch.no_grad():
            for name, parameter in self.trained.items():
                averaged[name].copy_(tensors[f"average.{name}"])
                if f"optimizer.step.{name}" in tensors:  # published networks have weights that nothing reads
                    self.optimizer.state[parameter] = {
                        key: tensors[f"optimizer.{key}.{name}"].to(parameter.device)
                        for key in ("step", "exp_avg", "exp_avg_sq")
                    }


def changed_fields(was: dict[str, Any], now: dict[str, Any], above: str = "") -> list[tuple[str, Any, Any]]:
    """Fields (dotted names) in which two recipes as JSON differ so that one does not continue the other's run.

    What only says how long, where and how often may change, see `MAY_CHANGE`, and so may what a recipe of an earlier
    version does not name.
    """
    found: list[tuple[str, Any, Any]] = []
    for name in sorted(was.keys() & now.keys() - (set() if above else MAY_CHANGE)):
        if isinstance(was[name], dict) and isinstance(now[name], dict):
            found += changed_fields(was[name], now[name], f"{above}{name}.")
        elif was[name] != now[name]:
            found.append((f"{above}{name}", was[name], now[name]))
    return found


def step_generator(seed: int, step: int) -> torch.Generator:
    """The source of all randomness of one step."""
    # a splitmix64 round spreads neighbouring (seed, step) over the generator's states
    mixed = (seed * 0x9E3779B97F4A7C15 + step * 0xBF58476D1CE4E5B9 + 1) % 2**63
    return torch.Generator().manual_seed(mixed)


def write_log(path: Path, step: int, values: dict[str, float]) -> None:
    """Append the values of one step to a log."""
    with path.open("a", newline="") as handle:
        csv.writer(handle).writerows([step, name, f"{value:.6g}"] for name, value in values.items())


def read_log(path: Path) -> list[tuple[int, str, float]]:
    """Rows (step, name, value) of a log file, none where there is no file; raises ValueError for other files."""
    if not path.exists():
        return []
    with raising(f"{path}: not the log of a training", OSError, KeyError, TypeError, ValueError, csv.Error):
        rows = csv.DictReader(path.read_text("utf-8").splitlines())
        return [(int(row["step"]), row["name"], float(row["value"])) for row in rows]


def plot_log(log: Path, out: Path) -> None:
    """Draw every curve of a log file, grouped by the word before the slash, into one picture."""
    from matplotlib.figure import Figure

    groups: dict[str, dict[str, list[tuple[int, float]]]] = {}
    for step, name, value in read_log(log):
        group, _, label = name.rpartition("/")
        groups.setdefault(group or "training", {}).setdefault(label, []).append((step, value))
    if not groups:
        return
    columns = min(3, len(groups))
    rows = math.ceil(len(groups) / columns)
    figure = Figure(figsize=(5 * columns, 3.5 * rows))
    axes = figure.subplots(rows, columns, squeeze=False)
    for axis, (group, curves) in zip(axes.flat, sorted(groups.items()), strict=False):
        for label, points in curves.items():
            axis.plot(*zip(*points, strict=True), label=label, linewidth=1)
        axis.set(title=group, xlabel="step")
        axis.legend(fontsize=6)
    figure.tight_layout()
    with whole_file(out, Path(out).suffix) as beside:
        figure.savefig(beside, dpi=110)
