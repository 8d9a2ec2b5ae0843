"""Scans that wait: for the stamps after them, and for odometry of their time."""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass

from glassslam.records import FloatArray, LaserScan
from glassslam.slam.odometry_track import OdometryTrack, mend_late_stamps

_LOOK_AHEAD = 3
_BATCH = 16
_LONGEST_WAIT = 1.0
_MOST_WAITING = 200


@dataclass(frozen=True, slots=True)
class TimedScan:
    """A scan whose turn has come.

    Attributes
    ----------
    scan : LaserScan
        As recorded.
    time : float
        Its stamp, mended where it came late, s.
    odometry_pose : ndarray of float64, shape (3,), or None
        Where the odometry says the base was, odometry frame.
    """

    scan: LaserScan
    time: float
    odometry_pose: FloatArray | None


class ScanQueue:
    """Gives scans out in the order they came, once their time and odometry are known.

    A scan waits for the next three and until odometry reaches its stamp, at most a second of recorded
    time. Scans are given out in batches: kernels run faster when their code stays in the cache.

    Parameters
    ----------
    track : OdometryTrack
        The odometry as it arrives.
    """

    def __init__(self, track: OdometryTrack) -> None:
        self._track = track
        self._scans: deque[tuple[LaserScan, FloatArray | None]] = deque()
        self._times: list[float] = []

    def __len__(self) -> int:
        return len(self._scans)

    @property
    def is_full(self) -> bool:
        """Whether a batch has gathered."""
        return len(self._scans) > _BATCH

    def add(self, scan: LaserScan) -> None:
        """Take a scan; odometry that came with the very same stamp belongs to it, whatever follows."""
        mend_late_stamps(self._times, scan.stamp)
        paired = self._track.latest_pose if self._track.latest == scan.stamp else None
        self._scans.append((scan, paired))
        self._times.append(scan.stamp)

    def take(self, *, everything: bool = False) -> Iterator[TimedScan]:
        """Scans whose turn has come; at the end of a recording, `everything` that waits."""
        while self._scans and (everything or (len(self._scans) > _LOOK_AHEAD and self._is_ready())):
            scan, paired = self._scans.popleft()
            time = self._times.pop(0)
            yield TimedScan(scan, time, self._track.pose_at(time) if paired is None else paired)

    def _is_ready(self) -> bool:
        """Whether odometry has reached the first scan, or is not coming."""
        if self._track.latest >= self._times[0] or len(self._scans) > _MOST_WAITING:
            return True
        return abs(self._times[-1] - self._times[0]) > _LONGEST_WAIT
