"""Paths, terminals and folders as other machines have them."""

import os
import stat
import subprocess
import sys

import pytest

from glassslam import accelerate
from glassslam.cli import main

LOG = "".join(
    f"FLASER 90 {' '.join(['2.0'] * 45 + ['2.5'] * 45)} {k / 10} 0 0 {k / 10} 0 0 {k}.5 host {k}.5\n"
    for k in range(12)
)
PROGRAM = [sys.executable, "-c", "import sys; from glassslam.cli import main; sys.exit(main())"]


@pytest.mark.parametrize(
    "name", ["two words", "Gebäude 日本", "it's 100% [new]", "-dash", "a\nline", "#1?x=y"]
)
def test_paths_of_any_name(tmp_path, name, capsys):
    folder = tmp_path / name
    folder.mkdir()
    (folder / f"{name}.log").write_text(LOG)
    words = ["map", str(folder / f"{name}.log"), "-o", str(folder / f"{name} map"), "--json"]
    assert main(words) == 0
    assert (folder / f"{name} map" / "report.json").exists()
    assert main(["inspect", str(folder / f"{name}.log")]) == 0
    assert capsys.readouterr().err == ""


@pytest.mark.skipif(not os.path.isdir("/proc"), reason="needs a folder that root cannot write")  # noqa: PTH112
@pytest.mark.parametrize("place", ["/proc/run", "/proc/deep/run", "/dev/null/run"])
def test_a_read_only_target_is_told_before_any_work(tmp_path, place, capsys):
    assert main(["map", str(tmp_path / "not even looked at.bag"), "-o", place]) == 1
    error = capsys.readouterr().err
    assert error.startswith(f"error: cannot write {place}: ")
    assert error.count("\n") == 1


def test_without_any_terminal_or_stream(tmp_path):
    """Started by a service: no standard input, output or error at all."""
    (tmp_path / "run.log").write_text(LOG)
    script = 'exec "$0" "$@" <&- >&- 2>&-'
    done = subprocess.run(
        ["sh", "-c", script, *PROGRAM, "map", "run.log", "-o", "out"], check=False, cwd=tmp_path, timeout=100
    )
    assert done.returncode == 0
    assert (tmp_path / "out" / "map.pgm").exists()


def test_a_reader_that_leaves_early_does_not_cost_the_map(tmp_path):
    (tmp_path / "run.log").write_text(LOG)
    read_end, write_end = os.pipe()
    os.close(read_end)
    done = subprocess.run(
        [*PROGRAM, "map", "run.log", "-o", "out"],
        check=False, cwd=tmp_path, stdout=write_end, stderr=subprocess.PIPE, text=True, timeout=100,
    )  # fmt: skip
    os.close(write_end)
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "out" / "report.json").exists()


KERNEL = """
import os
from glassslam.accelerate import kernel
print(os.environ["NUMBA_CACHE_DIR"])
@kernel
def twice(x):
    return 2 * x
assert twice(21) == 42
"""


def test_kernels_run_where_no_cache_can_be_written(tmp_path):
    script = tmp_path / "kernel.py"
    script.write_text(KERNEL)
    temporary = tmp_path / "tmp"
    temporary.mkdir()
    nowhere = dict.fromkeys(("NUMBA_CACHE_DIR", "XDG_CACHE_HOME", "HOME"), "/proc/nowhere")
    done = subprocess.run(
        [sys.executable, script],
        check=False, capture_output=True, text=True, timeout=100,
        env={**os.environ, **nowhere, "TMPDIR": str(temporary)},
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith(str(temporary))


def test_cached_kernels_of_others_are_never_run(tmp_path, monkeypatch):
    """A folder for all users may hold one of our name that somebody else has prepared."""
    monkeypatch.setattr(accelerate.tempfile, "gettempdir", lambda: str(tmp_path))
    monkeypatch.setattr(accelerate.tempfile, "tempdir", str(tmp_path))
    own = accelerate._own_folder()
    assert stat.S_IMODE(own.stat().st_mode) == 0o700
    assert accelerate._own_folder() == own
    own.chmod(0o777)
    assert accelerate._own_folder() != own
    own.rmdir()
    own.symlink_to(tmp_path)
    assert accelerate._own_folder() not in (own, tmp_path)
