"""`glassslam render` killed while it copies a session: what it leaves never hides the whole results."""

import shutil
import subprocess
import sys

import pytest
from session_worlds import assert_same_results

from glassslam.cli import main
from glassslam.session import SESSION_FILE, Session

KILLED = """
import os, sys
from glassslam.cli import main
from glassslam.session import session

def cut(database, path, target):
    target.write_bytes(open(path, "rb").read()[:{length}])
    target.with_name(target.name + "-journal").write_bytes(b"pages")
    os._exit(9)

session.write_compact = cut
sys.exit(main(["render", sys.argv[1], "-q"]))
"""


@pytest.fixture
def run(whole_run, tmp_path):
    """A finished run of its own."""
    return shutil.copytree(whole_run, tmp_path / "run")


def left_alone(run, whole):
    assert_same_results(run, whole)
    assert [path.name for path in run.parent.iterdir()] == ["run"]


@pytest.mark.parametrize("length", [0, 50, 40_000])
def test_a_copy_that_was_killed_hides_nothing(run, whole, length):
    words = [sys.executable, "-c", KILLED.format(length=length), str(run)]
    assert subprocess.run(words, check=False).returncode == 9
    assert run.with_name("run.partial").is_dir()
    assert main(["map", "--resume", str(run), "-q"]) == 0
    assert main(["recover", str(run)]) == 0
    assert main(["render", str(run), "-q"]) == 0
    left_alone(run, whole)


def test_a_session_that_is_empty_hides_nothing(run, whole, capsys):
    partial = run.with_name("run.partial")
    partial.mkdir()
    (partial / SESSION_FILE).write_bytes(b"")
    assert main(["recover", str(run)]) == 0
    assert capsys.readouterr().out == f"{run / SESSION_FILE} is sound: there is nothing to save\n"
    assert main(["map", "--resume", str(run)]) == 0
    assert capsys.readouterr().out == f"{run} is whole: there is nothing to go on with\n"
    assert main(["render", str(run), "-q"]) == 0
    left_alone(run, whole)


@pytest.mark.parametrize("content", [b"text\n" * 500, b"SQLite format 3\0" + bytes(84)])
def test_of_one_that_cannot_be_saved_the_way_out_is_told(run, whole, capsys, content):
    partial = run.with_name("run.partial")
    partial.mkdir()
    (partial / SESSION_FILE).write_bytes(content)
    assert main(["recover", str(run)]) == 1
    assert capsys.readouterr().err == (
        f"error: {partial / SESSION_FILE} cannot be saved: what tells its glassslam is lost "
        "(map the recording anew, with --overwrite; "
        f"or remove run.partial: what {run} holds stays as it was)\n"
    )
    assert main(["render", str(run), "-o", str(run.with_name("other")), "-q"]) == 0
    shutil.rmtree(partial)
    assert main(["render", str(run), "-q"]) == 0
    shutil.rmtree(run.with_name("other"))
    left_alone(run, whole)


def test_a_journal_never_meets_the_saved_session(partial_run, whole, tmp_path):
    """What is rolled back from the journal of another file makes that of a sound one worthless."""
    partial = shutil.copytree(partial_run, tmp_path / "run.partial")
    path = partial / SESSION_FILE
    content = path.read_bytes()
    header = bytes.fromhex("d9d505f920a163d7") + (0).to_bytes(4, "big") + b"salt" + (0).to_bytes(4, "big")
    header += (512).to_bytes(4, "big") + (4096).to_bytes(4, "big")
    path.write_bytes(b"X" + content[1:])
    path.with_name(f"{SESSION_FILE}-journal").write_bytes(header.ljust(512, b"\0"))
    assert main(["recover", str(partial.with_name("run"))]) == 3
    names = {file.name for file in partial.iterdir()}
    assert {f"{SESSION_FILE}.damaged", f"{SESSION_FILE}.damaged-journal"} <= names
    assert f"{SESSION_FILE}-journal" not in names
    with Session.open(path) as session:
        assert session.journal.scans == 149
    assert main(["map", "--resume", str(partial.with_name("run")), "-q"]) == 0
    assert_same_results(partial.with_name("run"), whole)


def test_a_copy_that_cannot_be_put_in_its_place(run, tmp_path):
    from glassslam.errors import OutputError

    (tmp_path / "taken").mkdir()
    with pytest.raises(OutputError, match=r"cannot write .*taken: Is a directory"):
        Session.copy(run / SESSION_FILE, tmp_path / "taken")
