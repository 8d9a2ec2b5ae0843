"""Sessions whose header, or that of their log, is lost: nothing of them is thrown away, and all is saved."""

import shutil

import pytest
from session_worlds import WORDS, assert_same_results, interrupted, snapshot

from glassslam.cli import main
from glassslam.session import SESSION_FILE, is_begun
from glassslam.session.salvage import salvage
from glassslam.slam import mapper

FRAME = 24 + 4096
KNOWN = 200


@pytest.fixture(scope="module")
def killed(bag, tmp_path_factory):
    """What a process leaves that is killed after 200 scans, most of them in the log."""
    home = tmp_path_factory.mktemp("killed")
    place, count = mapper.Mapper._place, 0

    def counted(self, timed):
        nonlocal count
        result = place(self, timed)
        count += 1
        if count % 20 == 0 and count <= KNOWN:
            self._journal.flush()
        if count == KNOWN:
            snapshot(home / "run.partial", home / "killed")
        return result

    mapper.Mapper._place = counted
    try:
        assert interrupted(["map", str(bag), "-o", str(home / "run"), *WORDS], KNOWN + 10) == 130
    finally:
        mapper.Mapper._place = place
    assert (home / "killed" / f"{SESSION_FILE}-wal").stat().st_size > 20 * FRAME
    return home / "killed"


@pytest.fixture
def partial(killed, tmp_path):
    return shutil.copytree(killed, tmp_path / "run.partial")


def overwrite(path, place, data):
    content = bytearray(path.read_bytes())
    content[place : place + len(data)] = data
    path.write_bytes(content)


FILE, LOG = SESSION_FILE, f"{SESSION_FILE}-wal"
DAMAGES = {
    "magic of the file": [(FILE, 0, b"X")],
    "header of the file": [(FILE, 0, bytes(100))],
    "size of pages": [(FILE, 16, b"\x20")],
    "no size of pages": [(FILE, 16, b"\x11")],
    "magic of the log": [(LOG, 0, b"XXXX")],
    "header of the log": [(LOG, 0, bytes(32))],
    "salt of the log": [(LOG, 17, b"\xff")],
    "both": [(FILE, 0, bytes(100)), (LOG, 0, bytes(32))],
    "checksum of a frame": [(LOG, 32 + 16, b"\xff\xff")],
    "salt of a frame": [(LOG, 32 + 3 * FRAME + 8, b"\xff\xff")],
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_all_scans_are_saved(partial, damage):
    for name, place, data in DAMAGES[damage]:
        overwrite(partial / name, place, data)
    saved = salvage(partial / SESSION_FILE, partial / "saved.db")
    assert (saved.scans, saved.scans_beyond, saved.is_finished) == (KNOWN, 0, False)


def test_a_page_of_the_log_that_is_damaged_costs_its_rows_alone(partial):
    overwrite(partial / LOG, 32 + 30 * FRAME + 24 + 2000, bytes(100))
    saved = salvage(partial / SESSION_FILE, partial / "saved.db")
    assert saved.scans + saved.scans_beyond > KNOWN - 40


def test_a_log_with_numbers_of_pages_beyond_all_measure_is_read(partial):
    overwrite(partial / LOG, 32 + 5 * FRAME, b"\xff\xff\xff\xff")
    assert salvage(partial / SESSION_FILE, partial / "saved.db").scans > 0


@pytest.mark.parametrize("damage", ["magic of the file", "header of the log", "both"])
def test_the_saved_run_is_gone_on_with(partial, whole, capsys, damage):
    for name, place, data in DAMAGES[damage]:
        overwrite(partial / name, place, data)
    run = partial.with_name("run")
    assert main(["map", "--resume", str(run), "-q"]) == 1
    assert "glassslam recover" in capsys.readouterr().err
    before = {name: (partial / name).read_bytes() for name in (FILE, LOG)}
    assert main(["recover", str(run)]) == 3
    assert capsys.readouterr().out.startswith(f"saved {KNOWN} scans and ")
    aside = {FILE: f"{FILE}.damaged", LOG: f"{FILE}.damaged-wal"}
    assert {name: (partial / aside[name]).read_bytes() for name in aside} == before
    assert main(["map", "--resume", str(run), "-q"]) == 0
    assert_same_results(run, whole)
    assert [path.name for path in run.parent.iterdir()] == ["run"]


def test_what_was_damaged_stays_until_the_run_is_whole(partial, whole):
    overwrite(partial / FILE, 0, b"X")
    run = partial.with_name("run")
    assert main(["recover", str(run)]) == 3
    assert interrupted(["map", "--resume", str(run), "-q"], KNOWN + 30) == 130
    assert {f"{FILE}.damaged", f"{FILE}.damaged-wal"} <= {path.name for path in partial.iterdir()}
    assert main(["map", "--resume", str(run), "-q"]) == 0
    assert_same_results(run, whole)


@pytest.mark.parametrize("content", [b"X", b"text\n" * 500, bytes(5000)])
def test_a_damaged_session_is_never_mapped_over(bag, partial, capsys, content):
    overwrite(partial / FILE, 0, content)
    run, before = partial.with_name("run"), (partial / LOG).read_bytes()
    assert main(["map", str(bag), "-o", str(run), "-q"]) == 2
    assert capsys.readouterr().err == (
        f"error: run.partial holds the session of a run into {run}, and it is damaged "
        f"(save what there is: glassslam recover {run}; or begin anew: --overwrite)\n"
    )
    assert (partial / LOG).read_bytes() == before


def test_with_overwrite_it_is(bag, partial, whole):
    overwrite(partial / FILE, 0, b"X")
    assert main(["map", str(bag), "-o", str(partial.with_name("run")), "--overwrite", *WORDS]) == 0
    assert_same_results(partial.with_name("run"), whole)


@pytest.mark.parametrize("step", ["copied", "log taken"])
def test_recover_may_be_killed_between_its_last_steps(partial, whole, step, capsys):
    overwrite(partial / FILE, 0, b"X")
    shutil.copyfile(partial / FILE, partial / f"{FILE}.damaged")
    if step == "log taken":
        (partial / LOG).rename(partial / f"{FILE}.damaged-wal")
    run = partial.with_name("run")
    assert main(["recover", str(run)]) == 3
    assert capsys.readouterr().out.startswith(f"saved {KNOWN} scans and ")
    assert main(["map", "--resume", str(run), "-q"]) == 0
    assert_same_results(run, whole)


def test_a_log_alone_is_the_beginning_of_a_session(tmp_path):
    path = tmp_path / FILE
    assert not is_begun(path)
    path.write_bytes(b"")
    assert not is_begun(path)
    (tmp_path / LOG).write_bytes(b"frames")
    assert is_begun(path)


def test_a_log_that_was_never_written_is_no_damage(partial, whole):
    """After a power cut the last file a process has made may hold nothing but zeros."""
    for name in (FILE, LOG):
        assert (partial / name).exists()
    (partial / LOG).write_bytes(bytes(32 + 3 * FRAME))
    run = partial.with_name("run")
    assert main(["map", "--resume", str(run), "-q"]) == 0
    assert_same_results(run, whole)
