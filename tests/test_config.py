"""The configuration: what it accepts, what it refuses, and that all of it is used."""

import ast
import math
from pathlib import Path

import pytest
import yaml
from pydantic import BaseModel

import glassslam
from glassslam.config import Config
from glassslam.errors import ConfigError, UsageError


def leaves(model=Config, path=()):
    """Every parameter as (path, field)."""
    for name, field in model.model_fields.items():
        if isinstance(field.annotation, type) and issubclass(field.annotation, BaseModel):
            yield from leaves(field.annotation, (*path, name))
        else:
            yield (*path, name), field


NAMES = [".".join(path) for path, _ in leaves()]


def nested(path, value):
    for name in reversed(path.split(".")):
        value = {name: value}
    return value


@pytest.fixture(scope="module")
def attributes():
    """Names read from any object, anywhere in the library but the configuration itself."""
    root = Path(glassslam.__file__).parent
    files = [
        path for path in root.rglob("*.py") if "parameters" not in path.parts and path.name != "config.py"
    ]
    trees = [ast.parse(path.read_text()) for path in files]
    return {node.attr for tree in trees for node in ast.walk(tree) if isinstance(node, ast.Attribute)}


@pytest.mark.parametrize("path", NAMES)
def test_every_parameter_is_read_somewhere(path, attributes):
    assert path.rpartition(".")[2] in attributes


def test_yaml_and_back_is_the_same():
    config = Config.from_mapping({"sensor": {"max_range": 12.5}, "local": {"solver": "casadi"}})
    assert Config.from_mapping(yaml.safe_load(config.dump())) == config
    assert list(yaml.safe_load(config.dump())) == list(Config.model_fields)


def test_what_a_file_does_not_name_keeps_its_default(tmp_path):
    path = tmp_path / "run.yaml"
    path.write_text("submap:\n  num_range_data: 30\n")
    config = Config.load(path)
    assert config.submap.num_range_data == 30
    assert config.submap.resolution == Config().submap.resolution
    assert config.sensor == Config().sensor
    path.write_text("")
    assert Config.load(path) == Config()


def test_it_is_frozen():
    with pytest.raises(ValueError, match="frozen"):
        Config().sensor.max_range = 3.0


class TestRefused:
    @pytest.mark.parametrize(
        ("data", "message", "hint"),
        [
            (
                {"local": {"solvr": "lm"}},
                "configuration: unknown parameter 'local.solvr'",
                "did you mean 'solver'?",
            ),
            (
                {"loop_closures": {"min_score": 0.4}},
                "configuration: unknown parameter 'loop_closures'",
                "did you mean 'loop_closure'?",
            ),
            (
                {"missing_data_ray_length": 3},
                "configuration: unknown parameter 'missing_data_ray_length'",
                "did you mean 'sensor.missing_data_ray_length'?",
            ),
            (
                {"local": {"solver": "lm"}, "loop_closure": {"solver": "lm"}},
                "configuration: unknown parameter 'loop_closure.solver'",
                "did you mean 'local.solver' or 'optimization.solver'?",
            ),
            (
                {"fusion": {"method": "walls"}},
                "configuration: unknown parameter 'fusion'",
                "did you mean 'sonar.fusion'?",
            ),
            (
                {"motion_filter": {"xyz": 1}},
                "configuration: unknown parameter 'motion_filter.xyz'",
                "known here: max_distance, max_angle_deg, max_time",
            ),
            (
                {"sensor": {"max_range": "far"}},
                "configuration: sensor.max_range: expected a number",
                "found 'far'",
            ),
            (
                {"sensor": {"max_range": -1}},
                "configuration: sensor.max_range: Input should be greater than 0",
                "found -1",
            ),
            (
                {"local": {"solver": "ceres"}},
                "configuration: local.solver: Input should be 'lm' or 'casadi'",
                "found 'ceres'",
            ),
            (
                {"submap": {"hit_probability": 0.4}},
                "configuration: submap.hit_probability: Input should be greater than 0.5",
                "found 0.4",
            ),
            (
                {"submap": {"num_range_data": 2.5}},
                "configuration: submap.num_range_data: expected a whole number",
                "found 2.5",
            ),
            (
                {"sensor": 3},
                "configuration: sensor: expected a mapping of names to values",
                "found 3",
            ),
        ],
    )
    def test_wrong_names_and_values_are_explained(self, data, message, hint):
        with pytest.raises(ConfigError) as caught:
            Config.from_mapping(data)
        assert (caught.value.message, caught.value.hint) == (message, hint)

    @pytest.mark.parametrize("section", ["map", "submap", "volume"])
    @pytest.mark.parametrize("resolution", [1.1, 100.0, 1e300])
    def test_cells_are_at_most_a_metre(self, section, resolution):
        message = rf"configuration: {section}\.resolution: Input should be less than or equal to 1"
        with pytest.raises(ConfigError, match=message):
            Config.from_mapping({section: {"resolution": resolution}})
        assert getattr(Config.from_mapping({section: {"resolution": 1.0}}), section).resolution == 1.0

    @pytest.mark.parametrize(("low", "high"), [(10.0, 5.0), (5.0, 5.0), (31.0, None)])
    def test_limits_that_leave_no_range(self, low, high):
        limits = {"min_range": low} if high is None else {"min_range": low, "max_range": high}
        with pytest.raises(ConfigError) as caught:
            Config.from_mapping({"sensor": limits})
        text = f"no range lies between min_range {low:g} and max_range {high or 30:g} m"
        assert caught.value.message == f"configuration: sensor: {text}"

    @pytest.mark.parametrize("path", NAMES)
    @pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
    def test_no_parameter_takes_what_is_not_finite(self, path, value):
        with pytest.raises(ConfigError, match=f"configuration: {path}: "):
            Config.from_mapping(nested(path, value))

    @pytest.mark.parametrize("data", [[1, 2], "sensor", 3])
    def test_what_is_no_mapping(self, data):
        name = type(data).__name__
        with pytest.raises(ConfigError, match=f"run: expected a mapping of sections, found {name}"):
            Config.from_mapping(data, origin="run")

    def test_a_missing_file_and_a_file_that_is_no_yaml(self, tmp_path):
        missing = tmp_path / "none.yaml"
        with pytest.raises(ConfigError, match=r"cannot read configuration .*none\.yaml: .*No such file"):
            Config.load(missing)
        broken = tmp_path / "broken.yaml"
        broken.write_text("a: [1\n")
        with pytest.raises(ConfigError, match=r"cannot read configuration .*broken\.yaml: "):
            Config.load(broken)
        broken.write_bytes(b"\xff\xfe\x00a")
        with pytest.raises(ConfigError, match=r"cannot read configuration .*broken\.yaml: "):
            Config.load(broken)

    @pytest.mark.parametrize(
        ("text", "cause"),
        [
            (b"map:\n  resolution: [1\n", "line 3: expected ',' or ']', but got '<stream end>'"),
            (b"map: {}\nglass: a: b\n", "line 2: mapping values are not allowed here"),
            (b"map: \xff", "it is no text, byte 5 is no UTF-8"),
        ],
    )
    def test_the_place_of_what_is_no_yaml_is_told(self, tmp_path, text, cause):
        path = tmp_path / "run.yaml"
        path.write_bytes(text)
        with pytest.raises(ConfigError) as caught:
            Config.load(path)
        assert caught.value.message == f"cannot read configuration {path}: {cause}"

    def test_the_file_is_named(self, tmp_path):
        path = tmp_path / "run.yaml"
        path.write_text("map:\n  resolution: 0\n")
        with pytest.raises(UsageError, match=r"run\.yaml: map\.resolution: Input should be greater than 0"):
            Config.load(path)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"band_low": 2.0}, "volume: no height lies between band_low 2 and band_high 1.8 m"),
        (
            {"band_low": 0.5, "band_high": 0.5},
            "volume: no height lies between band_low 0.5 and band_high 0.5 m",
        ),
        (
            {"occupied_threshold": 0.98},
            "volume: occupied_threshold does not lie between min_probability and max_probability",
        ),
        (
            {"lidar_weight": 0.0, "ultrasonic_weight": 0.0},
            "volume: lidar_weight and ultrasonic_weight are both 0",
        ),
        ({"lidar_height": math.nan}, "volume.lidar_height: Input should be a finite number"),
        ({"resolution": 0.001}, "volume.resolution: Input should be greater than or equal to 0.005"),
        ({"lidar_free": 0.6}, "volume.lidar_free: Input should be less than or equal to 0.5"),
        (
            {"ultrasonic_occupied": 0.4},
            "volume.ultrasonic_occupied: Input should be greater than or equal to 0.5",
        ),
        ({"ultrasonic_half_angle_deg": 181}, "volume.ultrasonic_half_angle_deg: Input should be less than"),
    ],
)
def test_senseless_volumes_are_refused(values, words):
    with pytest.raises(ConfigError, match=words):
        Config.from_mapping({"volume": values})
    assert Config.from_mapping({"volume": {"band_low": 2.0, "band_high": 3.0}}).volume.band_low == 2.0
