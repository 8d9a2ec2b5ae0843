"""Results that appear in DIR while a run goes or waits are replaced only where that was said."""

import shutil

import pytest
from session_worlds import SHORT, assert_same_results, interrupted

from glassslam.cli import main
from glassslam.cli import run as running


@pytest.fixture
def target(tmp_path):
    return tmp_path / "run"


def appear(target):
    target.mkdir()
    (target / "map.pgm").write_text("of somebody else")


def told(target, finished):
    beside = f"; or keep both: glassslam render {target} -o OTHER" if finished else ""
    return (
        f"error: {target} already holds results "
        f"(the run is kept; replace them: glassslam map --resume {target} --overwrite{beside})\n"
    )


@pytest.fixture
def finished_too_late(small_bag, target, monkeypatch, capsys):
    """A run that finds results where its own shall be."""
    conclude = running.conclude

    def late(*arguments, **options):
        appear(target)
        return conclude(*arguments, **options)

    monkeypatch.setattr(running, "conclude", late)
    assert main(["map", str(small_bag), "-o", str(target), *SHORT]) == 2
    monkeypatch.undo()
    assert capsys.readouterr().err == told(target, finished=True)
    assert [path.name for path in target.with_name("run.partial").iterdir()] == ["session.db"]


@pytest.mark.usefixtures("finished_too_late")
def test_a_finished_run_is_not_lost_to_results_that_have_appeared(target, small_whole, capsys):
    assert main(["map", "--resume", str(target), "-q"]) == 2
    assert capsys.readouterr().err == told(target, finished=True)
    assert main(["render", str(target), "-q"]) == 2  # no word of replacing what somebody else has put there
    assert (target / "map.pgm").read_text() == "of somebody else"
    assert main(["render", str(target), "-o", str(target.with_name("other")), "-q"]) == 0
    assert_same_results(target.with_name("other"), small_whole)
    assert (target / "map.pgm").read_text() == "of somebody else"
    assert main(["map", "--resume", str(target), "-q", "--overwrite"]) == 0
    assert_same_results(target, small_whole)


@pytest.mark.usefixtures("finished_too_late")
def test_it_goes_on_when_they_are_gone(target, small_whole):
    shutil.rmtree(target)
    assert main(["map", "--resume", str(target), "-q"]) == 0
    assert_same_results(target, small_whole)


def test_an_interrupted_run_does_not_replace_what_has_come_since(small_bag, target, small_whole, capsys):
    assert interrupted(["map", str(small_bag), "-o", str(target), *SHORT], 15) == 130
    appear(target)
    capsys.readouterr()
    assert main(["map", "--resume", str(target), "-q"]) == 2
    assert capsys.readouterr().err == told(target, finished=False)
    assert (target / "map.pgm").read_text() == "of somebody else"
    assert main(["map", "--resume", str(target), "-q", "--overwrite"]) == 0
    assert_same_results(target, small_whole)


def test_overwrite_said_once_holds_for_all_that_follows(small_bag, target, small_whole):
    words = ["map", str(small_bag), "-o", str(target), *SHORT, "--overwrite"]
    assert interrupted(words, 10) == 130
    appear(target)
    assert interrupted(["map", "--resume", str(target), "-q"], 20) == 130
    assert (target / "map.pgm").read_text() == "of somebody else"
    assert main(["map", "--resume", str(target), "-q"]) == 0
    assert_same_results(target, small_whole)


def test_overwrite_said_while_going_on_holds_as_well(small_bag, target, small_whole):
    assert interrupted(["map", str(small_bag), "-o", str(target), *SHORT], 10) == 130
    appear(target)
    assert interrupted(["map", "--resume", str(target), "-q", "--overwrite"], 20) == 130
    assert main(["map", "--resume", str(target), "-q"]) == 0
    assert_same_results(target, small_whole)


def test_results_put_aside_by_a_killed_run_do_not_come_back_over_those_of_another(small_bag, target, capsys):
    """Their place is empty when the run begins, and they are put back there: they are not its to replace."""
    appear(target)
    target.rename(target.with_name(".run.replaced"))
    assert main(["map", str(small_bag), "-o", str(target), *SHORT]) == 2
    assert "already holds results (use --overwrite to replace them)" in capsys.readouterr().err
    assert (target / "map.pgm").read_text() == "of somebody else"
    assert not target.with_name("run.partial").exists()
