"""The recording that most tests of sessions map, and two runs of it: a whole one and an interrupted one."""

import pytest
from session_worlds import PATH, SHORT, WORDS, interrupted, results, write_ring

from glassslam.cli import main


@pytest.fixture(scope="session")
def bag(tmp_path_factory):
    return write_ring(tmp_path_factory.mktemp("ring") / "ring.bag")


@pytest.fixture(scope="session")
def whole_run(bag, tmp_path_factory):
    """The directory of a run that nothing stops: to be copied, not to be changed."""
    folder = tmp_path_factory.mktemp("whole") / "run"
    assert main(["map", str(bag), "-o", str(folder), *WORDS]) == 0
    return folder


@pytest.fixture(scope="session")
def whole(whole_run):
    return results(whole_run)


@pytest.fixture(scope="session")
def partial_run(bag, tmp_path_factory):
    """The working directory of a run that was interrupted: to be copied, not to be changed."""
    folder = tmp_path_factory.mktemp("partial") / "run"
    assert interrupted(["map", str(bag), "-o", str(folder), *WORDS], 150) == 130
    return folder.with_name("run.partial")


@pytest.fixture(scope="session")
def small_bag(tmp_path_factory):
    """A few scans of that ring."""
    return write_ring(tmp_path_factory.mktemp("small") / "small.bag", PATH[:30])


@pytest.fixture(scope="session")
def small_whole(small_bag, tmp_path_factory):
    """The results of a whole run over them."""
    target = tmp_path_factory.mktemp("small_whole") / "run"
    assert main(["map", str(small_bag), "-o", str(target), *SHORT]) == 0
    return results(target)
