"""`glassslam evaluate`."""

import json

import numpy as np
import pytest

from glassslam.cli import main
from glassslam.outputs import write_results, write_tum
from glassslam.records import Trajectory


@pytest.fixture
def run(tmp_path, tiny_result):
    """Results directory of a run, with a relation file and a true trajectory beside it."""
    write_results(tiny_result, tmp_path / "run")
    first, second = tiny_result.trajectory.stamps
    (tmp_path / "relations").write_text(
        f"{first:.6f} {second:.6f} 0.3 0.3 0 0 0 0.1\n{first:.6f} {second + 60:.6f} 0 0 0 0 0 0\n"
    )
    long = np.column_stack((0.4 * np.arange(5), np.zeros((5, 2))))
    write_tum(Trajectory(first + 0.439833 * np.arange(5), long), tmp_path / "truth.tum")
    return tmp_path


def test_relations_are_compared(run, capsys):
    assert main(["evaluate", str(run / "run"), "--relations", str(run / "relations")]) == 0
    assert capsys.readouterr().out == (
        "relations, error inv(true) * estimated: 1 compared, 1 unmatched\n"
        "  translation  0.10000 +- 0.00000 m,  squared 0.010000 +- 0.000000 m^2\n"
        "  rotation     0.0000 +- 0.0000 deg,  squared 0.00000 +- 0.00000 deg^2\n"
    )


def test_the_other_way_of_counting_is_shown_on_demand(run, capsys):
    words = ["evaluate", str(run / "run"), "--relations", str(run / "relations"), "--verbose"]
    assert main(words) == 0
    assert "estimated * inv(true) (Cartographer's tool): 1 compared" in capsys.readouterr().out


def test_json_holds_the_same_numbers(run, capsys):
    words = ["evaluate", str(run / "run"), "--relations", str(run / "relations"), "--json", "--verbose"]
    assert main(words) == 0
    errors = json.loads(capsys.readouterr().out)
    assert set(errors) == {"relations", "relations_cartographer"}
    assert errors["relations"]["count"] == 1
    assert errors["relations"]["unmatched"] == 1
    assert errors["relations"]["translation"]["mean"] == pytest.approx(0.1)


def test_a_tum_file_is_compared_with_a_true_trajectory(run, capsys):
    truth = str(run / "truth.tum")
    assert main(["evaluate", truth, "--trajectory", truth, "--json"]) == 0
    errors = json.loads(capsys.readouterr().out)
    assert errors["ate"]["count"] == 5
    assert errors["ate"]["translation"]["rmse"] == pytest.approx(0.0)
    assert errors["rpe_pose"]["count"] == 4
    assert errors["rpe_metre"]["count"] == 1


def test_both_truths_are_shown_as_text(run, capsys):
    truth = str(run / "truth.tum")
    relations = run / "one.relations"
    first = Trajectory(np.array([1031745824.658]), np.zeros((1, 3))).stamps[0]
    relations.write_text(f"{first:.6f} {first + 0.439833:.6f} 0.4 0 0 0 0 0\n")
    assert main(["evaluate", truth, "--trajectory", truth, "--relations", str(relations)]) == 0
    text = capsys.readouterr().out
    assert text.startswith("relations, error")
    assert "absolute trajectory error, aligned without scale: 5 compared" in text
    assert "relative pose error, steps of 1 m: 1 compared" in text


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["nowhere", "--relations", "{}/relations"], "error: cannot read nowhere: No such file or directory"),
        (["{}/run", "--relations", "{}/none"], "error: cannot read {}/none: No such file or directory"),
        (
            ["{}", "--relations", "{}/relations"],
            "error: cannot read {}/trajectory.tum: No such file or directory",
        ),
    ],
)
def test_missing_files_are_named(run, capsys, words, line):
    assert main(["evaluate", *(word.format(run) for word in words)]) == 1
    assert capsys.readouterr().err == line.format(run) + "\n"


def test_a_truth_of_another_time_is_one_line(run, capsys):
    (run / "other").write_text("1 2 0 0 0 0 0 0\n")
    assert main(["evaluate", str(run / "run"), "--relations", str(run / "other")]) == 1
    assert capsys.readouterr().err.startswith(
        "error: none of the 1 relations has poses at both of its times ("
    )
