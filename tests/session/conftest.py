"""The recording that most tests of sessions map, and the results of a run that nothing stops."""

import pytest
from session_worlds import WORDS, results, write_ring

from glassslam.cli import main


@pytest.fixture(scope="session")
def bag(tmp_path_factory):
    return write_ring(tmp_path_factory.mktemp("ring") / "ring.bag")


@pytest.fixture(scope="session")
def whole(bag, tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole") / "run"
    assert main(["map", str(bag), "-o", str(folder), *WORDS]) == 0
    return results(folder)
