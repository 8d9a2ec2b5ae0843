"""Paths on the command line that name no place of their own: empty ones, the root, where the shell stands."""

import pytest

from glassslam.cli.app import main

UNSET = "perhaps a variable of the shell that is not set"


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    """A working directory that holds nothing."""
    folder = tmp_path / "here"
    folder.mkdir()
    monkeypatch.chdir(folder)
    return folder


@pytest.mark.parametrize(
    ("words", "place"),
    [
        (["map", ""], "after map"),
        (["map", "run.bag", "-o", ""], "after -o"),
        (["map", "run.bag", "--output="], "in --output="),
        (["map", "--resume", ""], "after --resume"),
        (["inspect", ""], "after inspect"),
        (["calibrate", "run.bag", ""], "after run.bag"),
        (["simulate", "office", "-o", ""], "after -o"),
        (["demo", "-o", ""], "after -o"),
        (["volume", "run.bag", "--trajectory", ""], "after --trajectory"),
        (["evaluate", ""], "after evaluate"),
        ([""], "after glassslam"),
    ],
)
def test_an_empty_path_is_not_the_working_directory(words, place, here, capsys):
    assert main(words) == 2
    assert capsys.readouterr().err == f"error: an empty argument {place} ({UNSET})\n"
    assert list(here.iterdir()) == []


@pytest.mark.parametrize("command", ["map", "calibrate"])
@pytest.mark.parametrize("place", [".", "..", "../here"])
@pytest.mark.parametrize("more", [[], ["--overwrite"]])
def test_results_never_replace_the_directory_of_the_shell(command, place, more, here, capsys):
    assert main([command, "run.bag", "-o", place, *more]) == 2
    told = f"error: -o {place}: results would replace the directory you are in"
    assert capsys.readouterr().err == f"{told} (choose a directory inside it, like -o results)\n"
    assert list(here.iterdir()) == []


@pytest.mark.parametrize(
    "words",
    [["map", "run.bag"], ["calibrate", "run.bag"], ["volume", "run.bag"], ["simulate", "office"], ["demo"]],
)
def test_the_root_is_no_place_for_results(words, capsys):
    assert main([*words, "-o", "/"]) == 2
    assert (
        capsys.readouterr().err == "error: -o /: no place for results (name a directory, like -o results)\n"
    )


@pytest.mark.parametrize("yaw", ["90", "-180", "6.3"])
def test_angles_of_poses_are_in_rad(yaw, capsys):
    assert main(["map", "run.bag", "--laser-pose", f"0.1,0,{yaw}"]) == 2
    assert f"a yaw of {yaw} rad is more than a turn ({yaw} deg is " in capsys.readouterr().err


def test_a_name_nearly_right_is_met_with_the_right_one(here, capsys):
    (here / "office.bag").write_text("")
    assert main(["inspect", "offce.bag"]) == 1
    assert capsys.readouterr().err == "error: offce.bag does not exist (did you mean office.bag?)\n"
    assert main(["inspect", "nowhere/office.bag"]) == 1
    told = "error: nowhere/office.bag does not exist (there is no folder nowhere)\n"
    assert capsys.readouterr().err == told
