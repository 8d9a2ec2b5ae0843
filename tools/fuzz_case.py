"""One run of the program on a damaged input, in a process of its own with limits, and what must hold."""

import json
import os
import resource
import signal
import sys
import time
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from glassslam.cli import main
from glassslam.outputs.directory import RESULT_FILES

CODES = (0, 1, 2, 3)
MEMORY_MB, CPU_SECONDS, WALL_SECONDS = 3072, 30, 240
_LARGEST_FILE = 1 << 30


@dataclass(frozen=True)
class Outcome:
    """How a run ended: exit code (negative: signal), what it said, and what it did wrong."""

    code: int
    error: str
    violations: tuple[str, ...]
    seconds: float


def run_case(words: Sequence[str], folder: Path) -> Outcome:
    """Run the command in a folder and look at what it says and leaves there."""
    before = {path.name for path in folder.iterdir()}
    inputs = _inputs(folder)
    start = time.monotonic()
    code = _wait(_fork(words, folder), start)
    error = (folder / ".stderr").read_text(errors="replace")
    output = (folder / ".stdout").read_text(errors="replace")
    for name in (".stderr", ".stdout"):
        (folder / name).unlink()
    left = {path.name for path in folder.iterdir()} - before
    if words[0] == "recover" and code in {0, 3}:
        left -= {"done.partial"}  # what was saved, and a map of it
    if "glassslam render out" in error or "glassslam map --resume out" in error:
        left -= {"out.partial"}  # SLAM is done: the error tells what to do with its session
    violations = [*_said_wrong(code, error), *_left_wrong(code, left, folder)]
    violations += [f"changed: {name}" for name, state in _inputs(folder).items() if inputs.get(name) != state]
    if "--json" in words and code in {0, 3}:
        violations += _printed_wrong(output)
    return Outcome(code, error, tuple(violations), time.monotonic() - start)


def _inputs(folder: Path) -> dict[str, tuple[int, int]]:
    """Length and time of change of every file that is not for results: none is ever written to."""
    return {
        str(path.relative_to(folder)): (path.stat().st_size, path.stat().st_mtime_ns)
        for path in folder.rglob("*")
        if path.is_file() and not path.relative_to(folder).parts[0].startswith(("out", ".", "done"))
    }


def _fork(words: Sequence[str], folder: Path) -> int:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # there are no threads that could hold a lock
        child = os.fork()
    if child == 0:
        code = 99
        try:
            _confine(folder)
            code = main(list(words))
            sys.stdout.flush()
            sys.stderr.flush()
        finally:
            os._exit(code)
    return child


def _confine(folder: Path) -> None:
    os.chdir(folder)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    for number, name in ((1, ".stdout"), (2, ".stderr")):
        target = os.open(name, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
        os.dup2(target, number)
        os.close(target)
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    limit = pages * resource.getpagesize() + (MEMORY_MB << 20)
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    resource.setrlimit(resource.RLIMIT_CPU, (CPU_SECONDS, CPU_SECONDS + 2))
    resource.setrlimit(resource.RLIMIT_FSIZE, (_LARGEST_FILE, _LARGEST_FILE))


def _wait(child: int, start: float) -> int:
    pause = 0.001
    while True:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            return os.waitstatus_to_exitcode(status)
        if time.monotonic() - start > WALL_SECONDS:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
            return -signal.SIGALRM
        time.sleep(pause)
        pause = min(1.3 * pause, 0.02)


def _said_wrong(code: int, error: str) -> list[str]:
    wrong = [] if code in CODES else [f"exit code {code}"]
    lines = error.splitlines()
    complaints = [line for line in lines if line.startswith("error: ")]
    if len(complaints) > 1:
        wrong.append(f"{len(complaints)} errors")
    if code in {1, 2} and not complaints:
        wrong.append("failed without a word")
    if code in {0, 3} and complaints:
        wrong.append("an error, but no failure")
    if others := [line for line in lines if not line.startswith(("error: ", "warning: "))]:
        wrong.append(f"foreign text: {others[-1][:120]}")
    for line in complaints:
        if "unexpected" in line and "please report" in line:
            wrong.append(line[:160])
        if "out of memory" in line:
            wrong.append("out of memory")
        if len(line) > 2000:
            wrong.append(f"an error of {len(line)} characters")
    return wrong


def _left_wrong(code: int, left: set[str], folder: Path) -> list[str]:
    results = {name for name in left if name == "out" or name.startswith("out.bag")}
    wrong = [f"left behind: {name}" for name in sorted(left - results)]
    if results and code not in {0, 3}:
        return [*wrong, "results in spite of a failure"]
    out = folder / "out"
    if (out / "map.yaml").exists():
        wrong += [f"{name} is missing" for name in RESULT_FILES if not (out / name).exists()]
        text = (out / "trajectory.tum").read_text()
        if "nan" in text or "inf" in text:
            wrong.append("a pose that is not finite")
    return wrong


def _printed_wrong(output: str) -> list[str]:
    try:
        json.loads(output, parse_constant=_refuse)
    except ValueError as error:
        return [f"no JSON: {error}"]
    return []


def _refuse(constant: str) -> Any:
    raise ValueError(f"the constant {constant}")
