"""Damaged and odd inputs by the thousand: the program must answer each with a result or one clear line.

    python tools/fuzz.py --cases 2000                      all kinds of input, in turn
    python tools/fuzz.py --kind messages --cases 500 --seed 3
    python tools/fuzz.py --kind truth --seed 3 --only 17 --keep found    one case again, kept in found/

Every case is one run of the program in a process of its own, with limits on memory and processor time. It
must end with exit code 0, 1, 2 or 3, say at most one line `error: ...`, show no traceback and no error it
calls unexpected, stay within the limits, and leave either whole results or nothing. The same seed gives the
same cases. Real recordings are taken from $GLASSSLAM_DATA; without it, or with --simulated, all are made.
"""

import argparse
import gc
import multiprocessing
import os
import shutil
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from random import Random

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ[_name] = "1"  # before numpy is loaded: a forked process must not miss threads

from fuzz_case import CODES, Outcome, run_case  # noqa: E402
from fuzz_inputs import KINDS, make_case  # noqa: E402
from fuzz_seeds import Seeds, make_seeds  # noqa: E402


@dataclass(frozen=True)
class Done:
    """A case that was run."""

    kind: str
    number: int
    words: tuple[str, ...]
    outcome: Outcome


def main() -> int:
    """Run the cases asked for and print a table."""
    wish = _parser().parse_args()
    kinds = wish.kind or list(KINDS)
    work = Path(tempfile.mkdtemp(prefix="glassslam-fuzz-"))
    try:
        seeds = make_seeds(work, None if wish.simulated else _data())
        _warm_up(seeds, work, kinds, 0 if wish.only is not None else min(20, 1 + wish.cases // 200))
        numbers = [wish.only] if wish.only is not None else range(-(-wish.cases // len(kinds)))
        tasks = [(kind, number) for number in numbers for kind in kinds]
        tasks = tasks[: max(wish.cases, 1)] if wish.only is None else tasks
        done = list(_run_all(tasks, seeds, work, wish))
    finally:
        shutil.rmtree(work, ignore_errors=True)
    return _report(done, kinds, wish.seed)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--cases", type=int, default=1000, help="how many, over all kinds [1000]")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--kind", choices=KINDS, action="append", help="may be repeated [all]")
    parser.add_argument("--only", type=int, metavar="NUMBER", help="only the case of this number")
    parser.add_argument("--keep", type=Path, metavar="DIR", help="keep the inputs of violating cases")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--simulated", action="store_true", help="no real recordings")
    return parser


def _data() -> Path | None:
    folder = Path(os.environ.get("GLASSSLAM_DATA", Path(__file__).parents[2] / "shared" / "data"))
    return folder if folder.is_dir() else None


def _warm_up(seeds: Seeds, work: Path, kinds: Sequence[str], rounds: int) -> None:
    """Load what cases will need once, rather than in each of them."""
    for number in range(rounds):
        for kind in kinds:
            folder = _folder(work, kind, -1)
            words = make_case(kind, Random(f"warm {kind} {number}"), seeds, folder)
            _quietly(words, folder)
            shutil.rmtree(folder)
    gc.collect()
    gc.freeze()


def _quietly(words: Sequence[str], folder: Path) -> None:
    """Run a command here, its words going nowhere; a case that kills is left to the real runs."""
    from glassslam.cli import main as program  # noqa: PLC0415

    here = Path.cwd()
    stdout, stderr = sys.stdout, sys.stderr
    with Path(os.devnull).open("w") as nowhere:
        sys.stdout = sys.stderr = nowhere
        os.chdir(folder)
        try:
            program(list(words))
        finally:
            os.chdir(here)
            sys.stdout, sys.stderr = stdout, stderr


def _folder(work: Path, kind: str, number: int) -> Path:
    folder = work / f"{kind}-{number}"
    folder.mkdir()
    return folder


def _run_all(
    tasks: Sequence[tuple[str, int]], seeds: Seeds, work: Path, wish: argparse.Namespace
) -> Iterator[Done]:
    """Every job takes each n-th case; results come back through a queue."""
    context = multiprocessing.get_context("fork")
    queue = context.Queue()

    def work_off(own: Sequence[tuple[str, int]]) -> None:
        for kind, number in own:
            queue.put(_run_one(kind, number, seeds, work, wish))

    jobs = [context.Process(target=work_off, args=(tasks[k :: wish.jobs],)) for k in range(wish.jobs)]
    for job in jobs:
        job.start()
    for count in range(len(tasks)):
        done: Done = queue.get()
        for text in done.outcome.violations:
            print(f"{done.kind} {done.number}: {text}   [{' '.join(done.words)}]", flush=True)
        if (count + 1) % 500 == 0:
            print(f"{count + 1} of {len(tasks)} cases", flush=True)
        yield done
    for job in jobs:
        job.join()


def _run_one(kind: str, number: int, seeds: Seeds, work: Path, wish: argparse.Namespace) -> Done:
    folder = _folder(work, kind, number)
    words = make_case(kind, Random(f"{wish.seed} {kind} {number}"), seeds, folder)
    kept = None
    if wish.keep is not None:
        kept = wish.keep / f"{kind}-{wish.seed}-{number}"
        shutil.rmtree(kept, ignore_errors=True)
        shutil.copytree(folder, kept)
    outcome = run_case(words, folder)
    if kept is not None and not outcome.violations and wish.only is None:
        shutil.rmtree(kept)
    elif kept is not None:
        (kept / "COMMAND").write_text(f"glassslam {' '.join(words)}\n{outcome.error}")
    shutil.rmtree(folder)
    return Done(kind, number, tuple(words), outcome)


def _report(done: Sequence[Done], kinds: Sequence[str], seed: int) -> int:
    print(f"{'kind':12} {'cases':>6} " + " ".join(f"{f'exit {code}':>7}" for code in CODES) + "  violations")
    wrong = [one for one in done if one.outcome.violations]
    for kind in [*kinds, "all"]:
        own = [one for one in done if kind in {one.kind, "all"}]
        codes = Counter(one.outcome.code for one in own)
        bad = [one for one in wrong if kind in {one.kind, "all"}]
        counts = " ".join(f"{codes[code]:7}" for code in CODES)
        print(f"{kind:12} {len(own):6} {counts} {len(bad):11}")
    for one in wrong:
        print(f"again: python tools/fuzz.py --kind {one.kind} --seed {seed} --only {one.number} --keep found")
    if done:
        slowest = max(done, key=lambda one: one.outcome.seconds)
        print(f"slowest: {slowest.kind} {slowest.number}, {slowest.outcome.seconds:.1f} s")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
