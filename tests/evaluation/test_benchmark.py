"""tools/benchmark.py."""

import json
import sys
from pathlib import Path

import benchmark
import pytest


def a_run(**changes):
    values = {
        "log": "aces",
        "recording": "aces.clf.gz",
        "exit_code": 0,
        "cpu": 6.9,
        "wall": 5.0,
        "peak_mb": 200.0,
        "real_time_factor": 273.0,
        "translation": 0.0375,
        "translation_std": 0.03,
        "rotation": 0.3734,
        "rotation_std": 0.4,
        "relations": 1279,
        "unmatched": 0,
        "trajectory": b"",
    }
    return benchmark.Run(**{**values, **changes})


def cells(run):
    return [next(iter(column.cells)) for column in benchmark.build_table([run]).columns]


def test_a_child_is_measured():
    code = "import sys; block = bytearray(90_000_000); sum(range(3_000_000)); sys.exit(3)"
    exit_code, cpu, wall, peak_mb = benchmark.measure([sys.executable, "-c", code])
    assert exit_code == 3
    assert cpu > 0.0
    assert wall > 0.0
    # no upper bound: a child starts from the memory of the process that forks it, here the whole test suite
    assert peak_mb > 90.0


def test_carmen_logs_come_by_default_and_bags_on_demand():
    def names(**options):
        return [path.name for _, path in benchmark.select_recordings(Path("f"), **options)]

    assert names(logs=["intel", "mit-csail"], bags=False) == ["intel.clf.gz", "mit-csail.clf.gz"]
    assert names(logs=["intel", "mit-csail"], bags=True) == ["intel.clf.gz", "intel.bag", "mit-csail.clf.gz"]


def test_targets_reached_are_green_and_set_beside_the_peers():
    row = cells(a_run())
    assert row[0] == "aces.clf.gz"
    assert row[1] == "[green]0.0375[/] +- 0.0300 (0.0375, 0.0375, 0.0378)"
    assert row[2] == "[green]0.373[/] +- 0.400 (0.373, 0.373, 0.501)"
    assert row[3] == "[green]6.9[/] (10, 1/10.0 of 69)"


@pytest.mark.parametrize(
    ("column", "change"),
    [(1, {"translation": 0.0376}), (2, {"rotation": 0.374}), (3, {"cpu": 10.1}), (6, {"peak_mb": 338.0})],
)
def test_targets_missed_are_red(column, change):
    row = cells(a_run(**change))
    assert [number for number, cell in enumerate(row) if "[red]" in cell] == [column]


def test_figures_are_printed_for_scripts(capsys):
    benchmark._show([a_run()], as_json=True)
    (row,) = json.loads(capsys.readouterr().out)
    assert row["translation"] == 0.0375
    assert "trajectory" not in row
