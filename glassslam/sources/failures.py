"""Whatever a reader library raises on a foreign or damaged file becomes one clear line."""

import errno
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from glassslam.errors import GlassSlamError, RecordingError, UnreachableRecordingError

DAMAGED_HINT = "the file looks truncated or damaged: copy it again, or repair it ({tool})"
REPAIR_TOOLS = {
    "rosbag1": "'rosbag reindex' for a ROS1 bag",
    "rosbag2-mcap": "'mcap recover' for an mcap file",
    "rosbag2-sqlite3": "'sqlite3 FILE .recover' for a db3 file",
    "player": "'gzip -t' tells whether a compressed log is complete",
    "carmen": "'gzip -t' tells whether a compressed log is complete",
}

# What the system says of places that a damaged file leads to; all else is trouble with the disk.
_OF_CONTENT = (None, errno.EINVAL, errno.EOVERFLOW, errno.EFBIG)


@contextmanager
def reading(path: Path, format_name: str = "") -> Iterator[None]:
    """Turn every exception of the enclosed reader into a `RecordingError` that names the file.

    Raises
    ------
    RecordingError
        Anything at all went wrong inside; `UnreachableRecordingError` where it is the disk, not the content.
    """
    try:
        yield
    except GlassSlamError:
        raise
    except PermissionError as error:
        raise UnreachableRecordingError(f"cannot read {path}: permission denied") from error
    except Exception as error:
        if isinstance(error, OSError) and error.errno not in _OF_CONTENT:
            raise UnreachableRecordingError(
                f"cannot read {path}: {describe(error)}", "its disk or the connection to it fails"
            ) from error
        tool = REPAIR_TOOLS.get(format_name)
        raise RecordingError(
            f"cannot read {path}: {describe(error)}", DAMAGED_HINT.format(tool=tool) if tool else ""
        ) from error


def describe(error: BaseException) -> str:
    """The first line of an exception's text, or its type where it has none."""
    if isinstance(error, OSError) and error.strerror:
        return error.strerror.lower()
    line = (str(error).strip().splitlines() or [""])[0].rstrip(".")
    return line or f"unexpected content ({type(error).__name__})"
