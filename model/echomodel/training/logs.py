"""Logs of a run: CSV (the record), TensorBoard where it is installed, and a plot of the curves."""

from __future__ import annotations

import csv
import math
from pathlib import Path
from typing import Any

from echomodel.files import whole_file


class RunLog:
    """Appends numbers per step to `log.csv` in long form (step, name, value), and to TensorBoard.

    Arguments:
        folder: the run's folder.
        start: steps done before this process; later rows (of a run that was cut off) are dropped.
    """

    def __init__(self, folder: Path, start: int = 0) -> None:
        self.path = folder / "log.csv"
        rows = [row for row in read_log(self.path) if row[0] <= start]
        with self.path.open("w", newline="") as handle:
            writer = csv.writer(handle)
            writer.writerow(["step", "name", "value"])
            writer.writerows(rows)
        self._board: Any = None
        try:
            from torch.utils.tensorboard import SummaryWriter

            self._board = SummaryWriter(str(folder / "tensorboard"), purge_step=start)
        except ImportError:
            pass  # TensorBoard is optional, the CSV file has everything

    def write(self, step: int, values: dict[str, float]) -> None:
        """Record the values of one step."""
        with self.path.open("a", newline="") as handle:
            csv.writer(handle).writerows([step, name, f"{value:.6g}"] for name, value in values.items())
        if self._board is not None:
            for name, value in values.items():
                self._board.add_scalar(name, value, step)

    def close(self) -> None:
        """Flush TensorBoard."""
        if self._board is not None:
            self._board.close()


def read_log(path: Path) -> list[tuple[int, str, float]]:
    """Rows (step, name, value) of a log file, none where there is no file; raises ValueError for other files."""
    if not path.exists():
        return []
    try:
        with path.open(encoding="utf-8", newline="") as handle:
            return [(int(row["step"]), row["name"], float(row["value"])) for row in csv.DictReader(handle)]
    except (OSError, KeyError, TypeError, ValueError, csv.Error) as error:
        raise ValueError(f"{path}: not the log of a training ({error})") from None


def plot_log(log: Path, out: Path) -> None:
    """Draw every curve of a log file, grouped by the word before the slash, into one picture."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    groups: dict[str, dict[str, list[tuple[int, float]]]] = {}
    for step, name, value in read_log(log):
        group, _, label = name.rpartition("/")
        groups.setdefault(group or "training", {}).setdefault(label, []).append((step, value))
    if not groups:
        return
    columns = min(3, len(groups))
    rows = math.ceil(len(groups) / columns)
    figure, axes = plt.subplots(rows, columns, squeeze=False, figsize=(5 * columns, 3.5 * rows))
    for axis, (group, curves) in zip(axes.flat, sorted(groups.items()), strict=False):
        for label, points in curves.items():
            axis.plot(*zip(*points, strict=True), label=label, linewidth=1)
        axis.set(title=group, xlabel="step")
        axis.legend(fontsize=6)
    figure.tight_layout()
    with whole_file(out, Path(out).suffix) as beside:
        figure.savefig(beside, dpi=110)
    plt.close(figure)
