"""`glassslam render`: other results of the same run, equal to those of a run with the same parameters."""

import shutil
import subprocess
import sys

import pytest
from session_worlds import WORDS, assert_same_results, interrupted, results, write_ring

from glassslam.cli import main
from glassslam.config import Config
from glassslam.errors import UsageError
from glassslam.session.changes import needs_recording

KILLED = """
import os, sys
from glassslam.cli import main, render
render.conclude = lambda *_args, **_words: os._exit(9)
main(sys.argv[1:])
"""
PLAIN = [*WORDS, "--set", "glass.scheme=anchored"]


@pytest.fixture(scope="module")
def home(tmp_path_factory):
    home = tmp_path_factory.mktemp("rendered")
    bag = write_ring(home / "ring.bag")
    assert main(["map", str(bag), "-o", str(home / "run"), *PLAIN]) == 0
    return home


@pytest.fixture
def run(home, tmp_path):
    shutil.copytree(home / "run", tmp_path / "run")
    return tmp_path / "run"


def mapped(home, tmp_path, *words):
    """Results of a whole run with further options."""
    assert main(["map", str(home / "ring.bag"), "-o", str(tmp_path / "mapped"), *PLAIN, *words]) == 0
    return results(tmp_path / "mapped")


@pytest.mark.parametrize(
    "words",
    [
        ["--set", "map.resolution=0.1", "--set", "map.hit_probability=0.7"],
        ["--set", "glass.scheme=off", "--set", "glass.walls.min_observations=2"],
        ["--set", "glass.thresh=2500", "--set", "glass.width=3"],
        ["--set", "glass.detector=off"],
        ["--set", "glass.detector=calibrated_peak", "--set", "glass.sensor=utm30lx"],
    ],
    ids=lambda words: words[1],
)
def test_it_gives_what_a_whole_run_gives(home, run, tmp_path, words):
    before = results(run)
    assert main(["render", str(run), "-o", str(tmp_path / "other"), *words, "-q"]) == 0
    assert_same_results(tmp_path / "other", mapped(home, tmp_path, *words))
    assert_same_results(run, before)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["mapped", "other", "run"]


def test_without_an_output_the_results_are_replaced(home, run, tmp_path):
    words = ["--set", "map.resolution=0.1"]
    assert main(["render", str(run), *words, "-q"]) == 0
    assert_same_results(run, mapped(home, tmp_path, *words))
    assert main(["render", str(run), "--set", "map.resolution=0.05", "-q"]) == 0
    assert_same_results(run, results(home / "run"))


@pytest.mark.parametrize(
    "assignment",
    ["submap.resolution=0.1", "sensor.max_range=5", "glass.scheme=local", "glass.ghosts_in_matching=false"],
)
def test_what_takes_part_in_slam_is_refused(run, capsys, assignment):
    before = results(run)
    assert main(["render", str(run), "--set", assignment]) == 2
    name = assignment.partition("=")[0]
    assert capsys.readouterr().err == (
        f"error: {name} takes part in SLAM and cannot be changed afterwards (map the recording again)\n"
    )
    assert_same_results(run, before)
    assert [path.name for path in run.parent.iterdir()] == ["run"]


def test_results_of_others_are_not_replaced(run, tmp_path, capsys):
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "map.pgm").write_text("old")
    assert main(["render", str(run), "-o", str(tmp_path / "other"), "-q"]) == 2
    assert "use --overwrite" in capsys.readouterr().err
    assert main(["render", str(run), "-o", str(tmp_path / "other"), "-q", "--overwrite"]) == 0


def test_the_recording_is_needed_only_to_look_for_glass_again(home, run, tmp_path, capsys):
    words = ["--set", "glass.thresh=2500"]
    expected = mapped(home, tmp_path, "--set", "map.resolution=0.1")
    bag = (home / "ring.bag").rename(home / "elsewhere.bag")
    try:
        assert main(["render", str(run), "--set", "map.resolution=0.1", "-q"]) == 0
        assert_same_results(run, expected)
        assert main(["render", str(run), *words, "-q"]) == 1
    finally:
        bag.rename(home / "ring.bag")
    assert "cannot read" in capsys.readouterr().err
    assert not (tmp_path / "run.partial").exists()


def test_a_map_beyond_all_memory_leaves_everything_as_it_was(run, capsys):
    before = results(run)
    assert main(["render", str(run), "--set", "map.resolution=0.00001"]) == 1
    assert "would take" in capsys.readouterr().err
    assert_same_results(run, before)
    assert [path.name for path in run.parent.iterdir()] == ["run"]


def test_a_map_too_large_to_draw_keeps_its_poses(home, tmp_path, capsys):
    target, huge = tmp_path / "run", ["--set", "map.resolution=0.00001"]
    assert main(["map", str(home / "ring.bag"), "-o", str(target), *PLAIN, *huge]) == 1
    told = f"poses are kept: glassslam render {target} --set ..."
    assert told in capsys.readouterr().err
    assert main(["map", "--resume", str(target), "-q"]) == 1
    assert told in capsys.readouterr().err
    assert main(["render", str(target), "--set", "map.resolution=0.05", "-q"]) == 0
    assert_same_results(target, results(home / "run"))


@pytest.mark.parametrize("again", [[], ["--set", "glass.thresh=2500"]], ids=["drawing", "reading"])
def test_an_interrupted_drawing_leaves_the_results_and_nothing_else(
    run, tmp_path, capsys, monkeypatch, again
):
    before = results(run)
    if not again:
        monkeypatch.setattr("glassslam.cli.render.conclude", _raise_interrupt)
        code = main(["render", str(run), "--set", "map.resolution=0.1", "-q"])
    else:
        code = interrupted(["render", str(run), *again, "-q"], 50)
    assert code == 130
    assert capsys.readouterr().err == ("error: interrupted (the results are as they were; draw them again)\n")
    assert [path.name for path in tmp_path.iterdir()] == ["run"]
    assert_same_results(run, before)


def _raise_interrupt(*_args, **_words):
    raise KeyboardInterrupt


def test_a_drawing_that_was_killed_does_not_change_the_next_one(run, tmp_path):
    before = results(run)
    words = ["render", str(run), "--set", "map.resolution=0.1", "-q"]
    assert subprocess.run([sys.executable, "-c", KILLED, *words], check=False).returncode == 9
    assert (tmp_path / "run.partial" / "session.db").exists()
    assert main(["map", "--resume", str(run), "-q"]) == 0
    assert main(["recover", str(run)]) == 0
    assert main(["render", str(run), "-q"]) == 0
    assert_same_results(run, before)
    assert [path.name for path in tmp_path.iterdir()] == ["run"]


def test_a_run_that_is_not_finished_is_finished_first(home, tmp_path, capsys):
    target = tmp_path / "cut"
    assert interrupted(["map", str(home / "ring.bag"), "-o", str(target), *PLAIN], 150) == 130
    capsys.readouterr()
    assert main(["render", str(target)]) == 2
    assert capsys.readouterr().err == (
        f"error: the run of {target} is not finished (go on: glassslam map --resume {target})\n"
    )


def changed(**sections):
    return needs_recording(Config(), Config.from_mapping(sections))


def test_which_parameters_need_what():
    assert not changed()
    assert not changed(map={"resolution": 0.1}, sonar={"algorithm": "ICL"}, volume={"resolution": 0.1})
    assert not changed(glass={"scheme": "off", "ghosts_in_map": "none", "walls": {"min_nodes": 2}})
    assert changed(glass={"detector": "wang_wang"})
    assert changed(glass={"grad": 3.0})
    with pytest.raises(UsageError, match=r"sonar\.scan_filter\.enabled"):
        changed(sonar={"scan_filter": {"enabled": True}})
    kept_out = Config.from_mapping({"glass": {"ghosts_in_matching": False}})
    other = Config.from_mapping({"glass": {"ghosts_in_matching": False, "thresh": 2.0}})
    with pytest.raises(UsageError, match=r"glass\.thresh takes part in SLAM"):
        needs_recording(kept_out, other)
