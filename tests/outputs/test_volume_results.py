"""What a run with points of a 3D sensor writes beyond the rest."""

import json
from dataclasses import replace

import numpy as np
import pytest

from glassslam.cli.summary import summary_rows
from glassslam.config import Config
from glassslam.outputs import build_report, check_directory, read_map, write_results
from glassslam.outputs.directory import ALL_FILES, RESULT_FILES, VOLUME_FILES
from glassslam.outputs.html_rows import volume_rows
from glassslam.records import PointSet
from glassslam.slam.node import Node
from glassslam.volume import files
from glassslam.volume.listener import VolumeListener
from glassslam.volume.storage import load_volume


@pytest.fixture
def mapped(tiny_result):
    """Makes the tiny run with a scan and a ping, at the time of its first pose."""

    def make(points=((1.01, 0.01, 0.81), (-1.0, 0.0, 0.5)), **parameters):
        config = Config.from_mapping({"volume": parameters})
        stamp = float(tiny_result.trajectory.stamps[0])
        returns = np.array([[2.01, 0.01]], dtype=np.float32)
        nodes = tuple(
            Node(k, k, stamp + 0.4 * k, np.zeros(3), np.zeros(2), returns, returns[:0], 0.1) for k in range(2)
        )
        ping = PointSet(stamp, np.array(points, dtype=np.float32).reshape(-1, 3), np.array([0.0, 0.0, 0.4]))
        info = replace(tiny_result.info, sonar_topics=("/sonar", "/points"), points_topics=("/points",))
        result = replace(tiny_result, nodes=nodes, config=config, info=info)
        return VolumeListener(config.volume, [ping], 0.25).joined(result)

    return make


def test_all_files_of_the_volume_are_written(mapped, tmp_path):
    written = write_results(mapped(), tmp_path / "run")
    assert {path.name for path in written} == {*RESULT_FILES, *VOLUME_FILES}
    assert {path.name for path in (tmp_path / "run").iterdir()} == {*RESULT_FILES, *VOLUME_FILES}
    assert set(files.VOLUME_FILES) < set(VOLUME_FILES) < set(ALL_FILES)


def test_they_hold_the_volume_and_its_map(mapped, tmp_path):
    result = mapped()
    write_results(result, tmp_path / "run")
    leaves = load_volume(tmp_path / "run" / "volume.npz").leaves()
    assert np.array_equal(leaves.log_odds, result.volume.tree.leaves().log_odds)
    grid = read_map(tmp_path / "run" / "volume_map.yaml")
    assert grid.probability.shape == result.volume.map.probability.shape
    row, column = (int((v - o) / 0.05) for v, o in zip((0.01, 1.01), grid.origin[::-1], strict=True))
    assert grid.probability[row, column] == 1.0


def test_a_run_without_points_writes_none_and_clears_earlier_ones(mapped, tiny_result, tmp_path):
    write_results(mapped(), tmp_path / "run")
    check_directory(tmp_path / "run", overwrite=True)
    write_results(tiny_result, tmp_path / "run", overwrite=True)
    assert not {path.name for path in (tmp_path / "run").iterdir()} & set(VOLUME_FILES)
    assert build_report(tiny_result)["volume"] is None
    assert list(volume_rows(None)) == []
    assert not [name for name, _ in summary_rows(build_report(tiny_result)) if name == "volume"]


def test_a_ping_without_echo_makes_a_volume_of_the_lidar_alone(mapped, tmp_path):
    written = write_results(mapped(points=()), tmp_path / "run")
    assert {*VOLUME_FILES} < {path.name for path in written}


def test_a_band_in_which_nothing_is_occupied_can_be_drawn(mapped, tmp_path):
    result = mapped(band_low=0.45, band_high=0.6)
    assert not (result.volume.map.probability > 0.65).any()
    assert {*VOLUME_FILES} < {path.name for path in write_results(result, tmp_path / "run")}
    high = mapped(band_low=5.0, band_high=6.0)
    assert np.isnan(high.volume.map.probability).all()
    assert {*VOLUME_FILES} < {path.name for path in write_results(high, tmp_path / "high")}


def test_the_report_tells_the_volume(mapped):
    found = json.loads(json.dumps(build_report(mapped()), allow_nan=False))["volume"]
    assert {name: found[name] for name in ("scans", "point_sets", "points", "pairs", "dropped")} == {
        "scans": 2,
        "point_sets": 1,
        "points": 1,
        "pairs": 1,
        "dropped": {"point outside of the field of view": 1},
    }
    assert (found["resolution"], found["lidar_height_m"], found["band_m"]) == (0.05, 0.25, [0.1, 1.8])
    assert (found["pool"], found["projection"]) == ("bayes", "max")
    # two returns of the lidar, seen from different places, and an echo; the rays to them are free
    assert found["occupied_voxels"] == 3
    assert found["free_voxels"] > 60
    low, high = found["bounds_m"]
    assert low == pytest.approx([0.0, 0.0, 0.25])
    assert high[2] == pytest.approx(0.85)


def test_the_page_tells_the_volume_and_shows_its_pictures(mapped, tmp_path):
    result = mapped()
    write_results(result, tmp_path / "run")
    page = (tmp_path / "run" / "report.html").read_text(encoding="utf-8")
    assert "<h2>Volume</h2>" in page
    pictures = [
        page.index(f'alt="{name}"') for name in ("map.png", "volume_map.png", "volume.png", "slices.png")
    ]
    assert pictures == sorted(pictures)
    rows = list(volume_rows(build_report(result)["volume"]))
    assert ("points", "1 of 1 pings") in rows
    assert ("left out", "1 x point outside of the field of view") in rows
    assert ("plane of the lidar", "0.25 m above the base") in rows
    assert ("heights in the map", "0.1 to 1.8 m above the base, by max") in rows
    assert '<th scope="row">points topic</th><td>/points</td>' in page
    assert '<th scope="row">sonar topic</th><td>/sonar</td>' in page


def test_the_summary_tells_the_volume(mapped):
    rows = summary_rows(build_report(mapped()))
    place = [name for name, _ in rows].index("volume")
    free = build_report(mapped())["volume"]["free_voxels"]
    assert rows[place : place + 3] == [
        ("volume", f"1 points of 1 pings, 3 occupied and {free} free voxels"),
        ("", "map of 0.1 to 1.8 m, lidar 0.25 m above the base"),
        ("", "left out: 1 x point outside of the field of view"),
    ]


def test_same_run_same_bytes(mapped, tmp_path):
    for name in ("a", "b"):
        write_results(mapped(), tmp_path / name)
    for name in VOLUME_FILES:
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes(), name
