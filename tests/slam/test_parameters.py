"""No parameter of the mapper is dead: all are read in a run with a loop and a doubtful match."""

import pytest
from pydantic import BaseModel
from slam_worlds import RING, odometry, recording, round_trip

from glassslam.config import Config
from glassslam.slam.mapper import Mapper

CONFIG = Config.from_mapping(
    {
        "sensor": {"max_range": 4.0},
        "submap": {"num_range_data": 20},
        "loop_closure": {"min_node_gap": 40},
        "local": {"correlative_search": "always"},
        "optimization": {"optimize_every_n_nodes": 60},
    }
)
ELSEWHERE = {"glass", "sonar", "volume"}
"""Sections that are read by other parts."""


class Watched:
    """A section that notes which of its parameters are read."""

    def __init__(self, section, name, read):
        self._section, self._name, self._read = section, name, read

    def __getattr__(self, name):
        value = getattr(self._section, name)
        path = f"{self._name}.{name}".lstrip(".")
        if isinstance(value, BaseModel):
            return Watched(value, path, self._read)
        self._read.add(path)
        return value


@pytest.fixture(scope="module")
def read():
    truth = round_trip(1.15)[::4]
    names = set()
    mapper = Mapper(Watched(CONFIG, "", names))
    for record in recording(RING, truth, odometry(truth, scale=1.03), beams=180):
        mapper.add(record)
    assert mapper.finish().statistics.closures_tried > 0
    return names


@pytest.mark.parametrize("section", sorted(set(Config.model_fields) - ELSEWHERE))
def test_every_parameter_of_a_section_is_read(section, read):
    names = {f"{section}.{name}" for name in type(getattr(CONFIG, section)).model_fields}
    assert names - read == set()
