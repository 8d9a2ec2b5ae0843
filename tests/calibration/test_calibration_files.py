"""The files of a calibration: both or none, and every damage told in one line."""

import cv2
import numpy as np
import pytest
import yaml
from pane_recordings import standing

from detectors.profiles import PROFILES, load_profile
from glassslam.calibration import FILES, Session, calibrate, read_calibration, write_calibration
from glassslam.calibration.figure import by_distance
from glassslam.calibration.files import as_yaml
from glassslam.errors import ConfigError, OutputError, UsageError


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("made")
    return calibrate([Session(standing(folder / "one.bag", 1.0, count=6), "glass", 1.0)])


def test_what_is_written_is_read_back(made, tmp_path):
    written = write_calibration(made, tmp_path / "out")
    assert [path.name for path in written] == list(FILES)
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == sorted(FILES)
    assert read_calibration(tmp_path / "out") == made.calibration
    assert read_calibration(tmp_path / "out" / "calibration.yaml") == made.calibration


def test_the_same_calibration_gives_the_same_bytes(made, tmp_path):
    first, second = (write_calibration(made, tmp_path / name) for name in ("a", "b"))
    for one, other in zip(first, second, strict=True):
        assert one.read_bytes() == other.read_bytes()


def test_the_picture_shows_something_in_each_of_its_three_parts(made, tmp_path):
    _, path = write_calibration(made, tmp_path / "out")
    picture = cv2.imread(str(path))
    assert picture.shape[1] > 1500
    for part in np.array_split(picture, 3, axis=1):
        assert (part.max(axis=2).astype(int) - part.min(axis=2) > 60).sum() > 100


def test_without_panes_the_picture_says_so(tmp_path):
    bag = standing(tmp_path / "none.bag", with_pane=False, count=4)
    plain = calibrate([Session(bag)])
    assert not plain.panes
    assert all(path.stat().st_size > 500 for path in write_calibration(plain, tmp_path / "out"))


def test_panes_are_grouped_by_their_distance(made):
    (name,) = by_distance(made.panes)
    assert name == "1.00 m (6 views)"


def test_earlier_calibrations_are_kept_unless_told_otherwise(made, tmp_path):
    write_calibration(made, tmp_path / "out")
    with pytest.raises(UsageError, match="already holds results"):
        write_calibration(made, tmp_path / "out")
    write_calibration(made, tmp_path / "out", overwrite=True)


def test_a_map_is_not_overwritten_by_a_calibration(made, tmp_path):
    (tmp_path / "map.pgm").write_text("a map")
    with pytest.raises(OutputError, match=r"holds files that are no results: map\.pgm"):
        write_calibration(made, tmp_path, overwrite=True)


def test_a_failure_leaves_nothing_behind(made, tmp_path, monkeypatch):
    def fail(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("glassslam.calibration.figure.write_figure", fail)
    with pytest.raises(OutputError, match="No space left"):
        write_calibration(made, tmp_path / "out")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", PROFILES)
def test_shipped_profiles_have_the_same_form(name, tmp_path):
    path = tmp_path / "calibration.yaml"
    path.write_text(as_yaml(load_profile(name)))
    assert read_calibration(path) == load_profile(name)


def damaged(**changes):
    plain = load_profile("utm30lx").to_dict()
    return yaml.safe_dump(plain | changes)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: [", "is no YAML file"),
        ("- 1", "is no calibration"),
        ("scans: 3", "is no calibration"),
        (damaged(thresh="high"), "thresh is no number: 'high'"),
        (damaged(width=2.5), "width is no whole number of 0 or more: 2.5"),
        (damaged(detector="magic"), "detector is not one of calibrated_peak, narrow_return, off: 'magic'"),
        (damaged(informative="yes"), "informative is neither true nor false: 'yes'"),
        (damaged(faint=float("nan")), "faint is not finite: nan"),
        (damaged(floor=-1.0), "floor is not 0 or more: -1.0"),
        (damaged(colour=1), "not a calibration: there is no 'colour'"),
        (damaged(pane={"haze": "x"}), "pane.haze is no number: 'x'"),
        (damaged(pane={"glow": 1.0}), "not a calibration: there is no 'pane.glow'"),
        (damaged(pane=3), "pane is no mapping of names: 3"),
        (damaged(date=20200101), "date is no text: 20200101"),
        (damaged(diffuse={"ranges": [1.0], "levels": "x"}), "diffuse.levels is no list of numbers: 'x'"),
        (damaged(diffuse={"ranges": [1.0, "a"], "levels": [1.0]}), "diffuse.ranges[1] is no number: 'a'"),
    ],
)
def test_every_damage_is_named(text, message, tmp_path):
    path = tmp_path / "calibration.yaml"
    path.write_text(text)
    with pytest.raises(ConfigError) as caught:
        read_calibration(path)
    assert message in caught.value.message
    assert str(path) in caught.value.message
    assert "\n" not in caught.value.message
    assert caught.value.exit_code == 2


def test_a_missing_file(tmp_path):
    with pytest.raises(ConfigError) as caught:
        read_calibration(tmp_path / "none.yaml")
    assert caught.value.message == f"cannot read calibration {tmp_path}/none.yaml: No such file or directory"
    assert caught.value.hint == "it is written by glassslam calibrate"
