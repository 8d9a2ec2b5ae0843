"""`glassslam config` and the options that decide the configuration."""

import pytest
import yaml

from glassslam.cli import main
from glassslam.cli.settings import default_directory, parse_pose, resolve_config
from glassslam.config import Config
from glassslam.errors import ConfigError, UsageError


def test_the_defaults_are_printed_complete(capsys):
    assert main(["config"]) == 0
    assert Config.from_mapping(yaml.safe_load(capsys.readouterr().out)) == Config()


def test_files_and_single_values_are_merged(tmp_path):
    file = tmp_path / "robot.yaml"
    file.write_text("sensor: {max_range: 12, min_range: 0.5}\n")
    config = resolve_config(file, ["sensor.max_range=20", "sensor.missing_data_ray_length=1e-3"])
    assert config.sensor.max_range == 20.0
    assert config.sensor.min_range == 0.5
    assert config.sensor.missing_data_ray_length == 1e-3


@pytest.mark.parametrize(
    ("assignment", "message", "hint"),
    [
        ("sensor.max_range", "--set sensor.max_range: not of the form section.name=value", ""),
        ("=3", "--set =3: not of the form section.name=value", ""),
        ("sensor.=3", "--set sensor.=3: not of the form section.name=value", ""),
        ("sensor.max_range.x=3", "--set sensor.max_range.x=3: 'max_range' is a value, not a section", ""),
        ("sensor.max_range=[", "--set sensor.max_range=[: the value is not YAML", ""),
        ("sensor.max_rage=3", "--set: unknown parameter 'sensor.max_rage'", "did you mean 'max_range'?"),
        ("senor.max_range=3", "--set: unknown parameter 'senor'", "did you mean 'sensor'?"),
    ],
)
def test_wrong_assignments_are_explained(assignment, message, hint):
    with pytest.raises(ConfigError) as caught:
        resolve_config(None, [assignment])
    assert (caught.value.message, caught.value.hint) == (message, hint)


def test_values_out_of_range_end_with_code_2(capsys):
    assert main(["config", "--set", "sensor.max_range=-1"]) == 2
    assert "sensor.max_range" in capsys.readouterr().err


def test_differences_are_listed(capsys, tmp_path):
    (tmp_path / "config.yaml").write_text("sensor: {max_range: 12}\n")
    assert main(["config", "--diff", "default", str(tmp_path)]) == 0
    assert capsys.readouterr().out == "sensor.max_range: 30.0 -> 12.0\n"


def test_equal_configurations_have_no_differences(capsys):
    assert main(["config", "--diff", "default", "default"]) == 0
    assert capsys.readouterr().out == ""


def test_laser_poses():
    assert parse_pose(None) is None
    assert parse_pose("-0.1,0,3.14") == (-0.1, 0.0, 3.14)


@pytest.mark.parametrize("text", ["1,2", "1,2,3,4", "a,b,c", "1,2,nan", "1,2,inf", ""])
def test_what_is_no_pose_is_refused(text):
    with pytest.raises(UsageError, match="not three numbers x,y,yaw"):
        parse_pose(text)


@pytest.mark.parametrize(
    ("recording", "directory"),
    [
        ("a/run.bag", "run-map"),
        ("intel.clf.gz", "intel-map"),
        ("folder/", "folder-map"),
        (".bag", ".bag-map"),
    ],
)
def test_results_are_named_after_the_recording(tmp_path, recording, directory):
    assert default_directory([tmp_path / recording]).name == directory
