"""glass_beams.npz, written and read back."""

import io

import numpy as np
import pytest

from glassslam.errors import EvaluationError, OutputError
from glassslam.glass.beam_labels import BeamLabelLog
from glassslam.outputs.beam_labels import read_arrays, read_beam_labels, write_beam_labels

LABELS = np.array([[1, 2, 2, 3, 0], [0, 0, 0, 0, 0], [3, 3, 1, 1, 2]], np.uint8)
STAMPS = np.array([10.0, 10.1, 10.2])
HINT = "it is written by map when a glass detector is on"


@pytest.fixture
def beams():
    return BeamLabelLog.of(STAMPS, LABELS).beams()


def saved(tmp_path, **arrays):
    path = tmp_path / "file.npz"
    with path.open("wb") as file:
        np.savez(file, **arrays)
    return path


def test_what_is_written_is_read(beams, tmp_path):
    path = write_beam_labels(beams, tmp_path / "glass_beams.npz")
    read = read_beam_labels(path)
    for name in ("stamps", "scan", "beam", "count", "label"):
        before, after = getattr(beams, name), getattr(read, name)
        assert (after.tolist(), after.dtype) == (before.tolist(), before.dtype)


def test_a_run_without_labels_is_written_too(tmp_path):
    path = write_beam_labels(BeamLabelLog().beams(), tmp_path / "glass_beams.npz")
    assert len(read_beam_labels(path)) == 0


def test_same_labels_same_bytes(beams, tmp_path):
    one, two = (write_beam_labels(beams, tmp_path / name).read_bytes() for name in "ab")
    assert one == two


def complaint(path, kind=OutputError):
    with pytest.raises(kind) as caught:
        read_beam_labels(path)
    return caught.value.message, caught.value.hint


def test_a_file_that_is_not_there_is_named(tmp_path):
    path = tmp_path / "none.npz"
    assert complaint(path) == (f"cannot read {path}: No such file or directory", HINT)


@pytest.mark.parametrize("content", [b"", b"hello", b"PK\x03\x04 not a zip", b"\x80\x04]q\x00."])
def test_a_file_of_another_kind_is_refused(tmp_path, content):
    path = tmp_path / "file.npz"
    path.write_bytes(content)
    assert complaint(path) == (f"{path} is no npz file", HINT)


def test_a_single_array_is_no_npz(tmp_path):
    path = tmp_path / "file.npz"
    with path.open("wb") as file:
        np.save(file, STAMPS)
    assert complaint(path) == (f"{path} is no npz file", HINT)


@pytest.mark.parametrize("kept", [0.3, 0.6, 0.9])
def test_a_file_cut_short_is_refused(beams, tmp_path, kept):
    whole = write_beam_labels(beams, tmp_path / "whole.npz").read_bytes()
    path = tmp_path / "file.npz"
    path.write_bytes(whole[: int(kept * len(whole))])
    assert complaint(path)[0] == f"{path} is no npz file"


def test_a_damaged_file_is_refused(beams, tmp_path):
    content = bytearray(write_beam_labels(beams, tmp_path / "whole.npz").read_bytes())
    content[60:90] = bytes(30)
    path = tmp_path / "file.npz"
    path.write_bytes(content)
    assert complaint(path)[0] == f"{path} is no npz file"


def test_objects_are_never_unpickled(tmp_path):
    path = saved(tmp_path, stamps=np.array([{}], dtype=object), scan=[0], beam=[0], count=[1], label=[2])
    assert complaint(path) == (f"{path} is no npz file", HINT)


def test_a_missing_array_is_named(tmp_path):
    path = saved(tmp_path, stamps=STAMPS, scan=[0], beam=[0], label=[2])
    assert complaint(path) == (f"{path} has no array 'count'", HINT)


@pytest.mark.parametrize(
    "change",
    [
        {"scan": [3]},
        {"scan": [-1]},
        {"beam": [-1]},
        {"count": [0]},
        {"label": [1]},
        {"label": [2, 2]},
        {"beam": [0.5]},
        {"stamps": [np.nan]},
        {"stamps": ["a"]},
        {"scan": [[0]]},
    ],
)
def test_other_arrays_are_refused(tmp_path, change):
    whole = {"stamps": [1.0, 2.0, 3.0], "scan": [0], "beam": [0], "count": [1], "label": [2]}
    path = saved(tmp_path, **{**whole, **change})
    assert complaint(path) == (
        f"{path} does not hold the labels of beams",
        "expected glass_beams.npz of map",
    )


def test_readers_of_other_files_raise_errors_of_their_own(tmp_path):
    (tmp_path / "x").write_bytes(b"x")
    with pytest.raises(EvaluationError, match="is no npz file"):
        read_arrays(tmp_path / "x", ("labels",), "", kind=EvaluationError)


def test_optional_arrays_may_be_missing(tmp_path):
    path = saved(tmp_path, a=[1], b=[2])
    assert set(read_arrays(path, ("a",), "", ("b", "c"))) == {"a", "b"}


def test_a_file_is_small(tmp_path):
    """An hour of 40 scans a second with 20 runs each takes a few megabytes before compression."""
    labels = np.zeros((200, 1081), np.uint8)
    labels[:, 100:300], labels[:, 500:560] = 2, 3
    buffer = io.BytesIO()
    np.savez(buffer, **{"labels": labels})
    path = write_beam_labels(BeamLabelLog.of(np.arange(200.0), labels).beams(), tmp_path / "b.npz")
    assert path.stat().st_size < 0.05 * buffer.getbuffer().nbytes
