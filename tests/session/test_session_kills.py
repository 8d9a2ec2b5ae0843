"""`kill -9` at any moment, then `--resume`: the same bytes as a run that nothing stops."""

import time

import pytest
from killing import BEFORE, FINISHING, READING, WRITING, Killer
from session_worlds import WORDS, ended, results, start, write_ring


def whole_run(words, home):
    """Results of a run that nothing stops, and how long it took, s."""
    began = time.monotonic()
    assert ended(start([*words, "-o", home / "whole"], home)) == (0, "")
    return results(home / "whole"), time.monotonic() - began


def test_three_kills(tmp_path):
    words = ["map", write_ring(tmp_path / "ring.bag"), *WORDS]
    expected, seconds = whole_run(words, tmp_path)
    (tmp_path / "home").mkdir()
    killer = Killer(words, tmp_path / "home", 316, expected, seconds, seed=1, pause=0.008)
    for aim in (BEFORE, READING, WRITING):
        killer.kill_once(aim)
    killer.finish()
    assert killer.kills + killer.whole >= 3
    assert killer.found[READING] >= 1


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1])
def test_forty_kills_of_a_real_log(data_dir, tmp_path, seed):
    """Half of them at random, the others where a run is seldom or where something is written."""
    words = ["map", data_dir / "freiburg" / "mit-csail.clf.gz", "--duration", "150", "-q"]
    expected, seconds = whole_run(words, tmp_path)
    scans = expected["report.json"]["scans"]["used"]
    assert scans > 500
    (tmp_path / "home").mkdir()
    killer = Killer(words, tmp_path / "home", scans, expected, 1.2 * seconds, seed)
    aims = [None, BEFORE, None, READING, None, FINISHING, None, WRITING]
    for k in range(200):
        killer.kill_once(aims[k % len(aims)])
        if killer.kills >= 40 and len(killer.found) == 4 and min(killer.found.values()) >= 3:
            break
    killer.finish()
    assert killer.kills >= 40
    assert set(killer.found) == {BEFORE, READING, FINISHING, WRITING}
