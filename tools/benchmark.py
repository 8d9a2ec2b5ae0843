"""Map the SICK logs of the SLAM benchmark and compare accuracy, time and memory with Cartographer.

python tools/benchmark.py                      the four CARMEN logs in $GLASSSLAM_DATA/freiburg
python tools/benchmark.py --logs aces --repeat 3
python tools/benchmark.py --bags --keep maps   the ROS bags as well; keep the results in maps/
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from rich.console import Console
from rich.table import Table

from glassslam.evaluation import evaluate_relations, read_relations
from glassslam.outputs import read_tum

ROOT = Path(__file__).resolve().parents[1]
LOGS_WITH_BAGS = ("intel", "aces")


@dataclass(frozen=True)
class Figures:
    """Errors by the relation metric, m and deg, and cost, CPU s and MB; None where not stated."""

    translation: float
    rotation: float
    cpu: float | None = None
    peak_mb: float | None = None


@dataclass(frozen=True)
class Yardstick:
    """What to reach on a log; what Cartographer reached in print, and measured with one configuration."""

    target: Figures
    published: Figures
    measured: Figures


YARDSTICKS = {
    "intel": Yardstick(
        Figures(0.0195, 0.364, 40.0), Figures(0.0229, 0.453), Figures(0.0489, 0.436, 705.0, 358.0)
    ),
    "aces": Yardstick(
        Figures(0.0375, 0.373, 10.0), Figures(0.0375, 0.373), Figures(0.0378, 0.501, 69.0, 337.0)
    ),
    "mit-csail": Yardstick(
        Figures(0.0319, 0.369, 10.0), Figures(0.0319, 0.369), Figures(0.0425, 0.616, 77.0, 150.0)
    ),
    "mit-killian": Yardstick(
        Figures(0.0395, 0.352, 60.0), Figures(0.0395, 0.352), Figures(0.0585, 1.225, 188.0, 964.0)
    ),
}


@dataclass(frozen=True)
class Run:
    """One run of `glassslam map` and its evaluation; times in s, errors in m and deg."""

    log: str
    recording: str
    exit_code: int
    cpu: float
    wall: float
    peak_mb: float
    real_time_factor: float
    translation: float
    translation_std: float
    rotation: float
    rotation_std: float
    relations: int
    unmatched: int
    trajectory: bytes


def measure(words: Sequence[str]) -> tuple[int, float, float, float]:
    """Exit code, CPU s (user and system, all threads), wall s and peak MB of a child process."""
    start = time.monotonic()
    child = subprocess.Popen(words)
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    wall = time.monotonic() - start
    peak_mb = usage.ru_maxrss * (1.0 if sys.platform == "darwin" else 1024.0) / 1e6
    return child.returncode, usage.ru_utime + usage.ru_stime, wall, peak_mb


def run_log(recording: Path, log: str, relations: Path, directory: Path, extra: Sequence[str]) -> Run | None:
    """Map one recording in a process of its own and evaluate it; None when it failed."""
    program = [sys.executable, "-c", "import sys; from glassslam.cli import main; sys.exit(main())"]
    words = [*program, "map", str(recording), "-o", str(directory), "--quiet", "--overwrite", *extra]
    code, cpu, wall, peak_mb = measure(words)
    if code not in (0, 3):
        return None
    errors = evaluate_relations(read_tum(directory / "trajectory.tum"), read_relations(relations))
    report = json.loads((directory / "report.json").read_text())
    return Run(
        log=log,
        recording=recording.name,
        exit_code=code,
        cpu=cpu,
        wall=wall,
        peak_mb=peak_mb,
        real_time_factor=report["recording_seconds"] / wall,
        translation=errors.translation.mean,
        translation_std=errors.translation.std,
        rotation=errors.rotation.mean,
        rotation_std=errors.rotation.std,
        relations=errors.count,
        unmatched=errors.unmatched,
        trajectory=(directory / "trajectory.tum").read_bytes(),
    )


def select_recordings(folder: Path, logs: Sequence[str], bags: bool) -> Iterator[tuple[str, Path]]:
    """Names of the logs and the recordings to map."""
    for log in logs:
        yield log, folder / f"{log}.clf.gz"
        if bags and log in LOGS_WITH_BAGS:
            yield log, folder / f"{log}.bag"


def build_table(runs: Sequence[Run]) -> Table:
    """Figures of the runs against those to reach (green: reached, red: not) and those of Cartographer."""
    table = Table(title="relation error and cost; in brackets: target, Cartographer published, measured")
    for column in ("recording", "m", "deg", "CPU s", "wall s", "x real time", "peak MB", "unmatched"):
        table.add_column(column, justify="left" if column == "recording" else "right")
    for run in runs:
        mark = YARDSTICKS[run.log]
        table.add_row(
            run.recording,
            _error(run.translation, run.translation_std, mark, "translation", 4),
            _error(run.rotation, run.rotation_std, mark, "rotation", 3),
            _cost(run.cpu, mark.target.cpu, mark.measured.cpu),
            f"{run.wall:.1f}",
            f"{run.real_time_factor:.0f}",
            _cost(run.peak_mb, mark.measured.peak_mb, mark.measured.peak_mb),
            f"{run.unmatched} of {run.relations + run.unmatched}",
        )
    return table


def _error(mean: float, std: float, mark: Yardstick, name: str, digits: int) -> str:
    limits = [getattr(figures, name) for figures in (mark.target, mark.published, mark.measured)]
    # Judged as it is printed: the targets themselves are rounded figures.
    colour = "green" if round(mean, digits) <= limits[0] else "red"
    others = ", ".join(f"{limit:.{digits}f}" for limit in limits)
    return f"[{colour}]{mean:.{digits}f}[/] +- {std:.{digits}f} ({others})"


def _cost(value: float, limit: float | None, peer: float | None) -> str:
    colour = "green" if limit is None or value <= limit else "red"
    ratio = f", 1/{peer / value:.1f} of {peer:.0f}" if peer else ""
    return f"[{colour}]{value:.1f}[/] ({'' if limit is None else f'{limit:.0f}'}{ratio})"


def parse_arguments() -> argparse.Namespace:
    """Options of the program."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--logs", nargs="+", choices=list(YARDSTICKS), default=list(YARDSTICKS))
    parser.add_argument("--bags", action="store_true", help="also map the ROS bags of intel and aces")
    parser.add_argument("--repeat", type=int, default=1, help="runs per recording; the cheapest counts")
    parser.add_argument("--keep", type=Path, help="keep the results in this folder")
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")
    parser.add_argument("options", nargs="*", help="after --: further options of glassslam map")
    return parser.parse_args()


def main() -> int:
    """Run the benchmark; 1 when a recording is missing, fails, or differs between repetitions."""
    arguments = parse_arguments()
    folder = Path(os.environ.get("GLASSSLAM_DATA", ROOT.parent / "shared" / "data")) / "freiburg"
    runs, failed = [], False
    with tempfile.TemporaryDirectory() as scratch:
        for log, recording in select_recordings(folder, arguments.logs, arguments.bags):
            target = (arguments.keep or Path(scratch)) / recording.name
            relations = folder / f"{log}.relations"
            repeated = [
                run_log(recording, log, relations, target, arguments.options)
                for _ in range(max(1, arguments.repeat))
            ]
            done = [run for run in repeated if run is not None]
            if len({run.trajectory for run in done}) != 1 or len(done) < len(repeated):
                print(f"{recording.name}: failed, or differs between runs", file=sys.stderr)
                failed = True
            if done:
                runs.append(min(done, key=lambda run: run.cpu))
    _show(runs, arguments.json)
    return int(failed)


def _show(runs: Sequence[Run], as_json: bool) -> None:
    if as_json:
        rows = [{k: v for k, v in asdict(run).items() if k != "trajectory"} for run in runs]
        print(json.dumps(rows, indent=2))
    elif runs:
        Console(width=None if sys.stdout.isatty() else 200).print(build_table(runs))


if __name__ == "__main__":
    sys.exit(main())
