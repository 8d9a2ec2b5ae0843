"""The disk is full at the n-th write, for every n: earlier results stay as they were, nothing else stays."""

import builtins
import errno
import io
import itertools
import os
import shutil

import numpy as np
import pytest
from odd_runs import changed, plain, run

from glassslam.calibration.files import write_calibration
from glassslam.errors import OutputError
from glassslam.outputs import RESULT_FILES, Stopwatch, write_results
from glassslam.volume.files import write_volume
from glassslam.volume.octree import Clamp, Octree


class Disk:
    """Counts what is done to the disk, and is full at one of the calls."""

    def __init__(self, full_at):
        self.calls, self._full_at = 0, full_at

    def touch(self):
        self.calls += 1
        if self.calls == self._full_at:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


class File:
    """A file whose writes may find the disk full."""

    def __init__(self, file, disk):
        self._file, self._disk = file, disk

    def write(self, content):
        self._disk.touch()
        return self._file.write(content)

    def __getattr__(self, name):
        return getattr(self._file, name)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._file.close()

    def __iter__(self):
        return iter(self._file)


@pytest.fixture
def full_disk(monkeypatch):
    """Makes the disk full at the n-th write, flush, new folder or renaming from now on."""

    def make(full_at):
        disk, plain_open = Disk(full_at), io.open

        def opened(path, mode="r", *rest, **options):
            if isinstance(path, int) or not set(mode) & set("wax+"):
                return plain_open(path, mode, *rest, **options)
            disk.touch()
            return File(plain_open(path, mode, *rest, **options), disk)

        def counted(function):
            def call(*arguments, **options):
                disk.touch()
                return function(*arguments, **options)

            return call

        monkeypatch.setattr(io, "open", opened)
        monkeypatch.setattr(builtins, "open", opened)
        for name in ("fsync", "mkdir", "rename", "replace"):
            monkeypatch.setattr(os, name, counted(getattr(os, name)))
        return disk

    return make


def content(folder):
    """Every file with its bytes, and every folder."""
    return {
        str(path.relative_to(folder)): path.read_bytes() if path.is_file() else None
        for path in folder.rglob("*")
    }


def restore(folder, before):
    for path in folder.iterdir():
        shutil.rmtree(path)
    for name, stored in before.items():
        if stored is None:
            (folder / name).mkdir(parents=True, exist_ok=True)
    for name, stored in before.items():
        if stored is not None:
            (folder / name).write_bytes(stored)


def every_failure(write, tmp_path, full_disk, monkeypatch):
    """Try with the disk full at the first, second ... call, until all calls are made; the failures."""
    before, failures = content(tmp_path), 0
    for n in itertools.count(1):
        disk, failed = full_disk(n), None
        try:
            write()
        except OutputError as error:
            failed = error
        finally:
            monkeypatch.undo()
        if disk.calls < n:
            assert failed is None
            return failures
        if failed is None:  # what failed was not needed, as making a folder that is there
            restore(tmp_path, before)
            continue
        failures += 1
        assert "No space left on device" in failed.message
        assert content(tmp_path) == before, f"call {n}"
    raise AssertionError


@pytest.fixture(scope="module")
def finished():
    """A run with all that looking for glass leaves."""
    random = np.random.default_rng(1)

    def change(_, scan):
        strengths = random.uniform(500, 3000, len(scan.ranges)).astype(np.float32)
        return type(scan)(**{n: getattr(scan, n) for n in scan.__slots__} | {"intensities": strengths})

    return run(changed(plain()[:80], change), glass={"detector": "intensity_peak"})


def test_earlier_results_survive_a_disk_full_at_any_write(finished, tmp_path, full_disk, monkeypatch):
    write_results(finished, tmp_path / "run")
    failures = every_failure(
        lambda: write_results(finished, tmp_path / "run", overwrite=True, stopwatch=Stopwatch()),
        tmp_path, full_disk, monkeypatch,
    )  # fmt: skip
    assert failures > 30
    assert {*RESULT_FILES, "glass.geojson", "glass_beams.npz", "labels.png"} <= set(content(tmp_path / "run"))


def test_new_results_appear_whole_or_not_at_all(tiny_result, tmp_path, full_disk, monkeypatch):
    failures = every_failure(
        lambda: write_results(tiny_result, tmp_path / "deep" / "run"), tmp_path, full_disk, monkeypatch
    )
    assert failures > 15


def test_a_calibration_survives_as_well(tmp_path, full_disk, monkeypatch):
    from types import SimpleNamespace

    from detectors.profiles import load_profile

    monkeypatch.setattr("glassslam.calibration.figure.write_figure", lambda _, path: path.write_bytes(b"P"))
    result = SimpleNamespace(calibration=load_profile("utm30lx"))
    write_calibration(result, tmp_path / "mine")
    (tmp_path / "mine" / "calibration.png").write_bytes(b"old")

    def write():
        monkeypatch.setattr(
            "glassslam.calibration.figure.write_figure", lambda _, path: path.write_bytes(b"P")
        )
        write_calibration(result, tmp_path / "mine", overwrite=True)

    assert every_failure(write, tmp_path, full_disk, monkeypatch) > 5


def test_a_volume_that_cannot_be_written_leaves_nothing(tmp_path, full_disk, monkeypatch):
    tree = Octree(0.1, Clamp())
    tree.add(tree.codes(np.array([[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]])), np.ones(2, dtype=np.float32))
    failures = every_failure(lambda: write_volume(tree, tmp_path / "run"), tmp_path, full_disk, monkeypatch)
    assert failures > 5
