"""`glassslam evaluate` with true labels of beams."""

import json

import numpy as np
import pytest

from glassslam.cli import main
from glassslam.glass.beam_labels import BeamLabelLog
from glassslam.outputs.beam_labels import write_beam_labels

SAID = np.array([[1, 2, 2, 1, 3], [1, 1, 1, 1, 1]], np.uint8)
TRUE = np.array([[1, 2, 1, 2, 3], [1, 1, 1, 1, 3]], np.uint8)


@pytest.fixture
def folder(tmp_path):
    """A run with labels and walls, and the truth beside its bag."""
    stamps = np.array([5.0, 5.1])
    run = tmp_path / "run"
    run.mkdir()
    write_beam_labels(BeamLabelLog.of(stamps, SAID).beams(), run / "glass_beams.npz")
    glass = json.dumps({"type": "FeatureCollection", "features": []})
    (run / "glass.geojson").write_text(glass)
    (tmp_path / "a.bag.truth.glass.geojson").write_text(glass)
    tables = {
        "range_dm": np.full(TRUE.shape, 15, np.uint8),
        "incidence_deg": np.full(TRUE.shape, 3, np.uint8),
    }
    np.savez(tmp_path / "a.bag.truth.labels.npz", stamps=stamps, labels=TRUE, **tables)
    return tmp_path


def lines(capsys):
    return [" ".join(line.replace("│", " ").split()) for line in capsys.readouterr().out.splitlines()]


def test_labels_beside_the_true_glass_are_found(folder, capsys):
    assert main(["evaluate", str(folder / "run"), "--glass", str(folder / "a.bag.truth.glass.geojson")]) == 0
    shown = lines(capsys)
    assert "beams: 10 in 2 scans" in shown
    assert any(line.startswith("glass 1 1 1 50.0 (") for line in shown)
    assert any(line.startswith("1 to 2 m 1 1 1 50.0 (") for line in shown)
    assert any(line.startswith("2 to 5 deg 1 1 50.0 (") for line in shown)
    assert any(line.startswith("ghosts 1 0 1 100.0 (") for line in shown)
    assert shown[-1] == "wrongly labelled glass: 1 solid"


def test_labels_can_be_given_alone(folder, capsys):
    words = ["evaluate", str(folder / "run"), "--labels", str(folder / "a.bag.truth.labels.npz"), "--json"]
    assert main(words) == 0
    errors = json.loads(capsys.readouterr().out)
    assert list(errors) == ["beams"]
    assert errors["beams"]["glass"]["true_positives"] == 1
    assert errors["beams"]["glass"]["precision"]["value"] == 0.5
    empty = errors["beams"]["by_range"][0]["score"]["recall"]
    assert (empty["trials"], empty["value"]) == (0, None)


def test_a_run_without_labels_is_compared_by_its_walls_alone(folder, capsys):
    (folder / "run" / "glass_beams.npz").unlink()
    words = ["evaluate", str(folder / "run"), "--glass", str(folder / "a.bag.truth.glass.geojson"), "--json"]
    assert main(words) == 0
    assert list(json.loads(capsys.readouterr().out)) == ["glass"]


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (
            ["{}", "--labels", "{}/a.bag.truth.labels.npz"],
            "cannot read {}/glass_beams.npz: No such file or directory"
            " (it is written by map when a glass detector is on)",
        ),
        (
            ["{}/run", "--labels", "{}/none.npz"],
            "cannot read {}/none.npz: No such file or directory"
            " (true labels are written by simulate beside the bag: BAG.truth.labels.npz)",
        ),
        (
            ["{}/run", "--labels", "{}/run/glass_beams.npz"],
            "{}/run/glass_beams.npz has no array 'labels'"
            " (true labels are written by simulate beside the bag: BAG.truth.labels.npz)",
        ),
    ],
)
def test_what_is_missing_is_told_in_one_line(folder, capsys, words, line):
    assert main(["evaluate", *(word.format(folder) for word in words)]) == 1
    assert capsys.readouterr().err == f"error: {line.format(folder)}\n"


def test_the_truth_of_another_recording_is_told_in_one_line(folder, capsys):
    other = folder / "other.npz"
    np.savez(other, stamps=np.array([99.0]), labels=TRUE[:1])
    assert main(["evaluate", str(folder / "run"), "--labels", str(other)]) == 1
    assert capsys.readouterr().err == (
        "error: no scan of the run has the stamp of a true one"
        " (the run spans 5.000 to 5.100 s, truth spans 99.000 to 99.000 s)\n"
    )
