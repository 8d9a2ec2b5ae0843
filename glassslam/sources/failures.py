"""Whatever a reader library raises on a foreign or damaged file becomes one clear line."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from glassslam.errors import GlassSlamError, RecordingError

DAMAGED_HINT = "the file looks truncated or damaged: copy it again, or repair it ({tool})"
REPAIR_TOOLS = {
    "rosbag1": "'rosbag reindex' for a ROS1 bag",
    "rosbag2-mcap": "'mcap recover' for an mcap file",
    "rosbag2-sqlite3": "'sqlite3 FILE .recover' for a db3 file",
    "player": "'gzip -t' tells whether a compressed log is complete",
    "carmen": "'gzip -t' tells whether a compressed log is complete",
}


@contextmanager
def reading(path: Path, format_name: str = "") -> Iterator[None]:
    """Turn every exception of the enclosed reader into a `RecordingError` that names the file.

    Raises
    ------
    RecordingError
        Anything at all went wrong inside.
    """
    try:
        yield
    except GlassSlamError:
        raise
    except PermissionError as error:
        raise RecordingError(f"cannot read {path}: permission denied") from error
    except Exception as error:
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
