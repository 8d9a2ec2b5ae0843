"""tools/glass_schemes.py."""

import json
import math
import sys
from pathlib import Path

import glass_schemes as tool
import numpy as np
import pytest
from rich.console import Console

from glassslam.errors import RecordingError
from glassslam.evaluation import evaluate_glass_cells
from glassslam.geometry import compose, inverse
from glassslam.outputs import write_tum
from glassslam.records import Trajectory

PANE = np.array([[[0.0, 0.0], [2.0, 0.0]]])


def errors(share, false=0):
    """Cells on a share of the pane, and so many elsewhere."""
    on = np.column_stack(
        (np.arange(0.025, 2.0 * share, 0.05), np.zeros(len(np.arange(0.025, 2.0 * share, 0.05))))
    )
    off = np.column_stack((np.arange(false) * 0.05 + 0.01, np.full(false, 5.0)))
    return evaluate_glass_cells(np.concatenate((on, off)), [PANE], resolution=0.05)


def printed(table):
    console = Console(width=160)
    with console.capture() as capture:
        console.print(table)
    return [" ".join(line.replace("│", " ").split()) for line in capture.get().splitlines()]


def test_the_table_has_a_row_for_every_building_and_drift_and_a_column_for_every_scheme():
    runs = [
        tool.Run("a", "lite", False, 50.0, 0.01, errors(0.5)),
        tool.Run("a", "anchored", False, 50.0, 0.01, errors(1.0, false=10)),
        tool.Run("a", "anchored", True, 50.0, 0.07, errors(1.0)),
        tool.Run("b", "lite", False, None, None, errors(1.0)),
    ]
    lines = printed(tool.build_table(runs, 0))
    assert " ".join(lines).startswith(
        "detected glass (m), accuracy (%) within 0.10 m, false glass (m, % of opaque)"
    )
    assert any("building" in line and "lite" in line and "anchored" in line for line in lines)
    assert "a 2.0 no 1.1 = 54.0 % 2.0 = 100.0 %" in lines
    assert "false 0.0 = 0.00 % false 0.5 = 1.00 %" in lines
    assert "a 2.0 yes - 2.0 = 100.0 %" in lines
    assert "b 2.0 no 2.0 = 100.0 % -" in lines


def test_the_tolerance_of_the_table_can_be_chosen():
    runs = [tool.Run("a", "lite", False, 50.0, 0.01, errors(0.5))]
    assert "within 0.25 m" in printed(tool.build_table(runs, 2))[0]


def test_the_map_is_laid_onto_the_truth_by_its_trajectory(tmp_path):
    """A map whose first pose is turned a little, in a world with a frame of its own."""
    true = np.column_stack((np.arange(9.0) + 3.0, np.sin(np.arange(9.0)), np.full(9, 0.3)))
    world_from_map = np.array([3.0, 1.0, 0.4])
    estimated = Trajectory(np.arange(9.0), compose(inverse(world_from_map), true))
    of = tool.Building("a", tmp_path / "a.bag", tmp_path / "truth", None)
    assert tool.true_from_map(estimated, of) is None
    write_tum(Trajectory(np.arange(9.0), true), tmp_path / "a.bag.truth.tum")
    pose, rmse = tool.true_from_map(estimated, of)
    assert pose == pytest.approx(compose(inverse(true[0]), world_from_map), abs=1e-6)
    assert math.isclose(rmse, 0.0, abs_tol=1e-6)


def test_a_building_is_a_bag_and_its_truth(tmp_path):
    (tmp_path / "a.bag.truth.json").write_text(json.dumps({"opaque_m": 12.5}))
    beside = tool.building(str(tmp_path / "a.bag"))
    assert (beside.name, beside.opaque) == ("a", 12.5)
    assert beside.truth == tmp_path / "a.bag.truth.glass.geojson"
    other = tool.building("b.bag=panes.geojson")
    assert (other.bag, other.truth, other.opaque) == (Path("b.bag"), Path("panes.geojson"), None)


def test_every_scheme_is_run_with_and_without_drift(tmp_path, monkeypatch, capsys):
    asked = []

    def run(of, scheme, config, *, drift):
        assert config.glass.scheme == scheme
        asked.append((of.name, scheme, drift, config.local.translation_weight))
        return tool.Run(of.name, scheme, drift, 50.0, 0.01, errors(1.0))

    monkeypatch.setattr(tool, "run", run)
    monkeypatch.setattr(sys, "argv", ["glass_schemes.py", "x.bag", "--schemes", "off", "global", "--json"])
    assert tool.main() == 0
    assert asked == [
        ("x", "off", False, 0.5),
        ("x", "global", False, 0.5),
        ("x", "off", True, 1000.0),
        ("x", "global", True, 1000.0),
    ]
    rows = json.loads(capsys.readouterr().out)
    assert [row["scheme"] for row in rows] == ["off", "global"] * 2
    assert rows[0]["false_percent"] == 0.0
    assert rows[0]["errors"]["within"][0]["found_percent"] == 100.0


def test_a_recording_that_fails_is_told_in_one_line(monkeypatch, capsys):
    def run(*_, **__):
        raise RecordingError("cannot read x.bag")

    monkeypatch.setattr(tool, "run", run)
    monkeypatch.setattr(sys, "argv", ["glass_schemes.py", "x.bag"])
    assert tool.main() == 1
    assert capsys.readouterr().err == "error: cannot read x.bag\n"
