"""How the robot moves: it steers for a carrot on the line of way points, within what its motors allow."""

import itertools
import math
from dataclasses import dataclass

import numpy as np

from glassslam.errors import ConfigError
from glassslam.geometry import wrap_angle
from glassslam.records import FloatArray
from glassslam.simulation.scene import Drive

_STEP = 0.005
_SLOWEST = 0.05
_ARRIVED = 0.02


@dataclass(frozen=True, slots=True)
class Motion:
    """The true motion of the robot base, densely sampled.

    Attributes
    ----------
    times : ndarray of float64, shape (n,)
        Seconds since the start, evenly spaced.
    poses : ndarray of float64, shape (n, 3)
        x, y and the heading, not wrapped, world frame, m and rad.
    speeds, yaw_rates : ndarray of float64, shape (n,)
        Twist of the base, m/s and rad/s.
    """

    times: FloatArray
    poses: FloatArray
    speeds: FloatArray
    yaw_rates: FloatArray

    def at(self, times: FloatArray) -> FloatArray:
        """Poses (n, 3) at any times (n,), headings not wrapped; the ends are held beyond the motion."""
        return np.stack([np.interp(times, self.times, self.poses[:, k]) for k in range(3)], axis=1)


@dataclass(slots=True)
class _State:
    x: float
    y: float
    heading: float
    speed: float = 0.0
    yaw_rate: float = 0.0


class _Line:
    """The polyline through the way points, by arc length."""

    def __init__(self, points: FloatArray) -> None:
        self._points = points
        self._steps = np.diff(points, axis=0)
        self._lengths = np.hypot(*self._steps.T)
        self.marks = np.concatenate(([0.0], np.cumsum(self._lengths)))

    def point(self, s: float) -> tuple[float, float]:
        k = min(max(int(np.searchsorted(self.marks, s, side="right")) - 1, 0), len(self._lengths) - 1)
        f = min((s - self.marks[k]) / self._lengths[k], 1.0)
        return (
            float(self._points[k, 0] + f * self._steps[k, 0]),
            float(self._points[k, 1] + f * self._steps[k, 1]),
        )


def drive_path(drive: Drive) -> Motion:
    """Drive once through all way points, from standing to standing.

    Raises
    ------
    ConfigError
        Two way points in a row are equal, or the robot cannot follow the line.
    """
    points = np.array([waypoint.at for waypoint in drive.waypoints])
    if np.any(np.hypot(*np.diff(points, axis=0).T) == 0.0):
        raise ConfigError("drive: two equal way points in a row")
    first = points[1] - points[0]
    state = _State(float(points[0, 0]), float(points[0, 1]), math.atan2(first[1], first[0]))
    rows: list[tuple[float, ...]] = [(state.x, state.y, state.heading, 0.0, 0.0)]
    _stand(state, drive.waypoints[0].stop or 0.0, rows)
    for begin, end in _legs(drive):
        _drive_leg(drive, _Line(points[begin : end + 1]), begin, state, rows)
        _stand(state, drive.waypoints[end].stop or 0.0, rows)
    data: FloatArray = np.array(rows)
    return Motion(
        np.arange(len(data), dtype=np.float64) * _STEP,
        data[:, :3].copy(),
        data[:, 3].copy(),
        data[:, 4].copy(),
    )


def _legs(drive: Drive) -> list[tuple[int, int]]:
    """Index pairs of the way points between which the robot does not stop."""
    last = len(drive.waypoints) - 1
    stops = [k for k in range(1, last) if drive.waypoints[k].stop is not None]
    marks = [0, *stops, last]
    return list(itertools.pairwise(marks))


def _stand(state: _State, seconds: float, rows: list[tuple[float, ...]]) -> None:
    rows.extend([(state.x, state.y, state.heading, 0.0, 0.0)] * round(seconds / _STEP))


def _drive_leg(drive: Drive, line: _Line, first: int, state: _State, rows: list[tuple[float, ...]]) -> None:
    length, s = float(line.marks[-1]), 0.0
    budget = 20.0 + 20.0 * length
    for _ in range(int(budget / _STEP)):
        carrot_x, carrot_y = line.point(min(s, length))
        while s < length and math.hypot(carrot_x - state.x, carrot_y - state.y) < drive.look_ahead:
            s = min(s + 0.01, length)
            carrot_x, carrot_y = line.point(s)
        ahead = math.hypot(carrot_x - state.x, carrot_y - state.y)
        if s >= length and (ahead < _ARRIVED or _passed(state, carrot_x, carrot_y)):
            break
        wanted = drive.waypoints[first + min(int(np.searchsorted(line.marks, s)), len(line.marks) - 1)].speed
        remaining = length - s + ahead
        _steer(drive, state, (carrot_x, carrot_y), wanted, remaining)
        rows.append((state.x, state.y, state.heading, state.speed, state.yaw_rate))
    else:
        raise ConfigError(f"drive: the robot cannot reach way point {first + len(line.marks) - 1}")
    _halt(drive, state, rows)


def _passed(state: _State, x: float, y: float) -> bool:
    """Whether the goal is abreast or behind and too near to turn for."""
    dx, dy = x - state.x, y - state.y
    return math.hypot(dx, dy) < 0.1 and dx * math.cos(state.heading) + dy * math.sin(state.heading) <= 0.0


def _steer(drive: Drive, state: _State, carrot: tuple[float, float], wanted: float, remaining: float) -> None:
    """One step towards the carrot: brake in time, slow down to turn, turn in place when it is behind."""
    dx, dy = carrot[0] - state.x, carrot[1] - state.y
    off = float(wrap_angle(math.atan2(dy, dx) - state.heading))
    turn = _braked(off, drive.yaw_acceleration, drive.yaw_rate)
    braking = math.sqrt(1.8 * drive.acceleration * max(remaining - _ARRIVED, 0.0))
    speed = min(wanted, braking + _SLOWEST)
    speed *= max(0.0, math.cos(off)) ** 3 if abs(off) < math.pi / 2 else 0.0
    _advance(drive, state, speed, turn)


def _braked(off: float, acceleration: float, fastest: float) -> float:
    """Yaw rate that can still be stopped within the angle `off`; proportional when it is small."""
    return math.copysign(min(fastest, 2.5 * abs(off), math.sqrt(2 * acceleration * abs(off))), off)


def _advance(drive: Drive, state: _State, speed: float, turn: float) -> None:
    dv, dw = drive.acceleration * _STEP, drive.yaw_acceleration * _STEP
    speed = min(max(speed, state.speed - dv), state.speed + dv)
    turn = min(max(turn, state.yaw_rate - dw), state.yaw_rate + dw)
    middle = state.heading + 0.25 * (turn + state.yaw_rate) * _STEP
    mean_speed = 0.5 * (speed + state.speed)
    state.x += mean_speed * math.cos(middle) * _STEP
    state.y += mean_speed * math.sin(middle) * _STEP
    state.heading += 0.5 * (turn + state.yaw_rate) * _STEP
    state.speed, state.yaw_rate = speed, turn


def _halt(drive: Drive, state: _State, rows: list[tuple[float, ...]]) -> None:
    while state.speed > 0.0 or state.yaw_rate != 0.0:
        _advance(drive, state, 0.0, 0.0)
        rows.append((state.x, state.y, state.heading, state.speed, state.yaw_rate))
