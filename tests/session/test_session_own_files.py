"""A working directory is the user's folder too: only what runs write there is ever removed."""

import shutil

import pytest
from session_worlds import SHORT, WORDS, assert_same_results, interrupted, results

from glassslam.cli import main
from glassslam.cli.workplace import clear_but_session, made_directory


@pytest.fixture(scope="module")
def small_partial(small_bag, tmp_path_factory):
    """The working directory of a run over a few scans that was interrupted."""
    folder = tmp_path_factory.mktemp("begun") / "run"
    assert interrupted(["map", str(small_bag), "-o", str(folder), *SHORT], 15) == 130
    return folder.with_name("run.partial")


def content(folder):
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture
def refused(tmp_path, capsys):
    """Runs a command that must change nothing; the code and the one line of its error."""

    def run(*words):
        before = content(tmp_path)
        code = main([*map(str, words)])
        error = capsys.readouterr().err
        assert content(tmp_path) == before
        assert error.count("\n") == 1
        return code, error.removeprefix("error: ").removesuffix("\n")

    return run


@pytest.mark.parametrize("overwrite", [[], ["--overwrite"]])
def test_a_run_never_removes_what_is_not_its_own(small_bag, tmp_path, refused, overwrite):
    partial = tmp_path / "house.partial"
    partial.mkdir()
    for name in ("run.bag", "other.bag", "map.png"):
        shutil.copyfile(small_bag, partial / name)
    words = ["map", partial / "run.bag", "-o", tmp_path / "house", *SHORT, *overwrite]
    assert refused(*words) == (
        1, f"{partial} holds what is no result: other.bag (move it away, or choose another directory)",
    )  # fmt: skip


def test_nor_does_a_run_that_goes_on(small_bag, small_partial, tmp_path, refused):
    partial = shutil.copytree(small_partial, tmp_path / "run.partial")
    (partial / "diary.txt").write_text("dear diary")
    for words in (["map", small_bag], ["map"]):
        assert refused(*words, "--resume", tmp_path / "run", "-q") == (
            1, f"{partial} holds what is no result: diary.txt (move it away, or choose another directory)",
        )  # fmt: skip


@pytest.mark.parametrize("name", ["map.png", "session.db.new"])
def test_a_recording_in_the_working_directory_is_refused_whatever_its_name(
    small_bag, small_partial, tmp_path, refused, name
):
    partial = tmp_path / "run.partial"
    partial.mkdir()
    shutil.copyfile(small_bag, partial / name)
    told = (
        f"{partial / name} lies in {partial}, which belongs to the run (move it, or choose another directory"
    )
    assert refused("map", partial / name, "-o", tmp_path / "run", *SHORT) == (1, f"{told})")
    shutil.copytree(small_partial, partial, dirs_exist_ok=True)
    shutil.copyfile(small_bag, partial / name)
    assert refused("map", partial / name, "--resume", tmp_path / "run", "-q") == (
        1, f"{told}; then go on: glassslam map --resume {tmp_path / 'run'})",
    )  # fmt: skip


def test_what_appears_while_the_directory_is_made_stays(tmp_path):
    folder = tmp_path / "run.partial"

    def fail():
        (folder / "letter").write_text("dear friend")
        (folder / "session.db").write_text("")
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError), made_directory(folder, replacing=False):
        fail()
    assert [path.name for path in folder.iterdir()] == ["letter"]


def test_a_damaged_session_put_aside_stays_until_the_run_is_whole(small_bag, small_partial, tmp_path):
    partial = shutil.copytree(small_partial, tmp_path / "run.partial")
    kept = {"session.db", "session.db-wal", "session.db.damaged", "session.db.damaged-wal"}
    for name in (*(kept - {"session.db"}), "session.db.new", "map.pgm"):
        (partial / name).write_bytes(b"")
    clear_but_session(partial)
    assert {path.name for path in partial.iterdir()} == kept
    assert main(["map", "--resume", str(tmp_path / "run"), "-q"]) == 0
    assert main(["map", str(small_bag), "-o", str(tmp_path / "whole"), *SHORT]) == 0
    assert_same_results(tmp_path / "run", results(tmp_path / "whole"))


def test_a_working_directory_that_is_a_link_is_refused(small_bag, small_partial, tmp_path, refused):
    elsewhere = shutil.copytree(small_partial, tmp_path / "elsewhere")
    link = tmp_path / "run.partial"
    link.symlink_to(elsewhere)
    told = 1, f"{link} is a link (remove it, or choose another directory)"
    for overwrite in ([], ["--overwrite"]):
        assert refused("map", small_bag, "-o", tmp_path / "run", *SHORT, *overwrite) == told
    assert refused("map", "--resume", tmp_path / "run", "-q") == told
    assert link.is_symlink()
    link.unlink()
    link.symlink_to(tmp_path / "nowhere")
    assert refused("map", small_bag, "-o", tmp_path / "run", *SHORT) == told


def test_a_working_directory_that_is_a_file_is_refused(small_bag, tmp_path, refused):
    (tmp_path / "run.partial").write_text("dear diary")
    assert refused("map", small_bag, "-o", tmp_path / "run", *SHORT) == (
        1, f"{tmp_path / 'run.partial'} is a file (choose another directory)",
    )  # fmt: skip


def test_results_that_stand_in_a_working_directory_are_kept(small_bag, tmp_path, refused):
    """Somebody has named their results so."""
    assert main(["map", str(small_bag), "-o", str(tmp_path / "run.partial"), *SHORT]) == 0
    told = f"{tmp_path / 'run.partial'} holds whole results (move them away, or choose another directory)"
    assert refused("map", small_bag, "-o", tmp_path / "run", *SHORT, "--overwrite") == (1, told)
    (tmp_path / "run.partial" / "session.db").unlink()  # as results of the library
    assert refused("map", small_bag, "-o", tmp_path / "run", *SHORT) == (1, told)


def test_a_partial_map_is_no_whole_results(small_bag, small_partial, tmp_path):
    shutil.copytree(small_partial, tmp_path / "run.partial")
    assert (small_partial / "report.html").exists()
    assert main(["map", str(small_bag), "-o", str(tmp_path / "run"), *SHORT, "--overwrite"]) == 0


def test_results_are_named_by_the_directory_one_is_in(small_bag, tmp_path, monkeypatch, capsys):
    run = tmp_path / "run"
    assert main(["map", str(small_bag), "-o", str(run), *SHORT]) == 0
    expected = results(run)
    (run / "below").mkdir()
    for place, name in ((run, "."), (run / "below", "..")):
        monkeypatch.chdir(place)
        assert main(["map", "--resume", name]) == 0
        assert main(["recover", name]) == 0
        assert main(["render", name, "-o", str(tmp_path / f"other{len(name)}"), "-q"]) == 0
        assert_same_results(tmp_path / f"other{len(name)}", expected)
    out, error = capsys.readouterr()
    assert out.count(f"{run} is whole: there is nothing to go on with\n") == 2
    assert error == ""


def test_a_run_goes_on_from_within_its_working_directory(small_partial, tmp_path, monkeypatch):
    shutil.copytree(small_partial, tmp_path / "run.partial")
    monkeypatch.chdir(tmp_path / "run.partial")
    assert main(["map", "--resume", ".", "-q"]) == 0
    assert [path.name for path in tmp_path.iterdir()] == ["run"]


@pytest.mark.parametrize("command", [["map", "--resume"], ["render"], ["recover"]])
def test_the_root_of_all_is_no_results_directory(refused, command):
    assert refused(*command, "/") == (
        2, "/ is no results directory (name the results directory of a run)",
    )  # fmt: skip


def test_whole_results_are_drawn_while_a_run_into_them_waits(bag, whole_run, tmp_path, capsys):
    target = shutil.copytree(whole_run, tmp_path / "run")
    assert interrupted(["map", str(bag), "-o", str(target), *WORDS, "--overwrite"], 20) == 130
    waiting = content(tmp_path / "run.partial")
    capsys.readouterr()
    assert main(["render", str(target), "-o", str(tmp_path / "other"), "-q"]) == 0
    assert_same_results(tmp_path / "other", results(whole_run))
    found = content(tmp_path / "run.partial")
    assert {path: found[path] for path in waiting} == waiting
    shutil.rmtree(target)
    assert main(["render", str(target), "-o", str(tmp_path / "third"), "-q"]) == 2
    assert capsys.readouterr().err == (
        f"error: the run of {target} is not finished (go on: glassslam map --resume {target})\n"
    )


def test_a_run_killed_as_it_began_is_no_hindrance_to_drawing(small_bag, tmp_path):
    run = tmp_path / "run"
    assert main(["map", str(small_bag), "-o", str(run), *SHORT]) == 0
    expected = results(run)
    for name in ("session.db", "session.db.new"):
        (tmp_path / "run.partial").mkdir()
        (tmp_path / "run.partial" / name).write_bytes(b"")
        assert main(["render", str(run), "-q"]) == 0
        assert_same_results(run, expected)
        assert [path.name for path in tmp_path.iterdir()] == ["run"]
