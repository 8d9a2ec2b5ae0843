"""Bags written for a test and opened, and what to read from them."""

import itertools

import pytest
from tiny_bags import write_ros1, write_ros2

from glassslam.sources import SourceOptions, open_recording


@pytest.fixture(params=["ros1", "ros2", "mcap"])
def any_bag(request, tmp_path):
    """Opens a bag of any version with these messages."""

    def make(*messages, **options):
        if request.param == "ros1":
            path = write_ros1(tmp_path / "run.bag", messages)
        else:
            path = write_ros2(tmp_path / "run", messages, {"ros2": "sqlite3", "mcap": "mcap"}[request.param])
        return open_recording(path, SourceOptions(**options))

    return make


@pytest.fixture
def ros1(tmp_path):
    """Opens ROS1 bags with these messages, each under a name of its own."""
    numbers = itertools.count()

    def make(*messages, **options):
        path = tmp_path / f"run{next(numbers)}.bag"
        return open_recording(write_ros1(path, messages), SourceOptions(**options))

    return make
