"""Targets that other machines have: nested and new, mounted, with something in the place of the lock."""

import os
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from glassslam.cli import main
from glassslam.errors import OutputError
from glassslam.outputs import check_directory, directory
from glassslam.outputs.lock import locked

LOG = "".join(
    f"FLASER 90 {' '.join(['2.0'] * 45 + ['2.5'] * 45)} {k / 10} 0 0 {k / 10} 0 0 {k}.5 host {k}.5\n"
    for k in range(12)
)
PROGRAM = [sys.executable, "-c", "import sys; from glassslam.cli import main; sys.exit(main())"]


@pytest.mark.parametrize("below", ["deep/run", "a/b/c/run"])
def test_the_lock_is_the_same_when_the_directory_has_been_made(tmp_path, below):
    target = tmp_path / below
    with locked(target):
        target.with_name("run.partial").mkdir(parents=True, exist_ok=True)
        with pytest.raises(OutputError, match="another run is writing to"), locked(target):
            pass
        target.mkdir()
        with pytest.raises(OutputError, match="another run is writing to"), locked(target):
            pass
    assert sorted(path.name for path in target.parent.iterdir()) == ["run", "run.partial"]


def test_parents_made_for_a_lock_go_with_it_unless_something_is_there(tmp_path):
    with locked(tmp_path / "a" / "b" / "run"):
        (tmp_path / "a" / "letter").write_text("dear friend")
    assert [path.name for path in tmp_path.rglob("*")] == ["a", "letter"]
    (tmp_path / "a" / "letter").unlink()
    with locked(tmp_path / "a" / "run"):
        pass
    assert [path.name for path in tmp_path.rglob("*")] == ["a"]


def test_runs_that_fail_side_by_side_never_lose_their_locks(tmp_path):
    """Parents come and go all the time; at no moment are there two within."""
    inside, seen = threading.Lock(), []

    def enter():
        for _ in range(300):
            try:
                with locked(tmp_path / "deep" / "run"):
                    seen.append(inside.acquire(blocking=False))
                    inside.release()
            except OutputError:
                pass

    threads = [threading.Thread(target=enter) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(seen) > 100
    assert all(seen)
    # the last to leave may not be the one who has made it
    assert [path.name for path in tmp_path.rglob("*")] in ([], ["deep"])


def test_a_directory_in_the_place_of_the_lock_is_told(tmp_path, capsys):
    (tmp_path / "run.log").write_text(LOG)
    place = tmp_path / ".out.lock"
    place.mkdir()
    assert main(["map", str(tmp_path / "run.log"), "-o", str(tmp_path / "out"), "--quiet"]) == 1
    assert capsys.readouterr().err == (
        f"error: cannot lock {tmp_path / 'out'}: {place} is a directory "
        "(remove it, or choose another directory)\n"
    )
    assert sorted(path.name for path in tmp_path.iterdir()) == [".out.lock", "run.log"]


def test_a_mount_point_is_refused_before_any_work(tmp_path, monkeypatch, capsys):
    target = tmp_path / "out"
    target.mkdir()
    monkeypatch.setattr(directory.os.path, "ismount", lambda path: Path(path) == target)
    words = ["map", str(tmp_path / "not even looked at.bag"), "-o", str(target)]
    assert main([*words, "--overwrite"]) == 1
    assert capsys.readouterr().err == f"error: {target} is a mount point (name a folder inside it)\n"
    check_directory(target / "run")


@pytest.mark.parametrize("name", ["out", "two words", "back\\slash"])
def test_a_folder_mounted_twice_on_one_disk_is_a_mount_point_too(tmp_path, monkeypatch, name):
    target = tmp_path / name
    target.mkdir()
    check_directory(target)
    listed = str(target).replace("\\", "\\134").replace(" ", "\\040")
    line = f"36 35 98:0 /mnt1 {listed} rw,noatime master:1 - ext3 /dev/root rw\n"
    read = Path.read_text

    def mounted(self, *arguments, **options):
        return line if str(self) == "/proc/self/mountinfo" else read(self, *arguments, **options)

    monkeypatch.setattr(directory.Path, "read_text", mounted)
    with pytest.raises(OutputError, match="is a mount point"):
        check_directory(target)


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs a full device")  # noqa: PTH110
@pytest.mark.parametrize("words", [[], ["--json"]])
def test_a_summary_that_cannot_be_printed_does_not_cost_the_map(tmp_path, words):
    (tmp_path / "run.log").write_text(LOG)
    with open("/dev/full", "w") as full:  # noqa: PTH123
        done = subprocess.run(
            [*PROGRAM, "map", "run.log", "-o", "out", *words],
            check=False, cwd=tmp_path, stdout=full, stderr=subprocess.PIPE, text=True, timeout=100,
        )  # fmt: skip
    assert (done.returncode, done.stderr) == (
        3,
        "error: cannot write to standard output: No space left on device (the results in out are whole)\n",
    )
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out", "run.log"]
    assert (tmp_path / "out" / "report.json").exists()
