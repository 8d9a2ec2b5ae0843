"""Simulate a long tour with laser and sonars: the path and the map of a real run become path and world.

glassslam map intel.clf.gz -o intel-map
python tools/sonar_tour.py intel-map -o tour                    tour/tour.bag, 30 minutes, 20,000 sonar sweeps
python tools/sonar_tour.py killian-map -o tour --begin 600 --minutes 45 --sweeps 30000
glassslam map tour/tour.bag -o tour-map
glassslam evaluate tour-map --truth tour/tour.bag.truth.map.yaml --trajectory tour/tour.bag.truth.tum
"""

import argparse
import math
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from glassslam.errors import GlassSlamError, UsageError
from glassslam.outputs import read_map, read_tum
from glassslam.records import FloatArray, Trajectory
from glassslam.simulation import (
    Motion,
    Scene,
    SonarModel,
    simulate_along,
    sonar_model,
    true_map,
    truth_paths,
    write_recording,
    write_true_map,
)
from glassslam.slam.result import OccupancyMap

_STEP = 0.02
_SMALLEST = 3
_STRAIGHT = 0.7
_BODY = 0.3
_FASTEST = 3.0
_SMOOTH = 0.5
# Sonars need this long for 5 m there and back.
_PING = 0.03


@dataclass(frozen=True)
class Tour:
    """What is asked for."""

    minutes: float = 30.0
    begin: float = 0.0
    sweeps: int = 20_000
    lidar: str = "lms200"
    rate: float = 5.0
    ring: str = "pioneer-3dx"
    seed: int = 0


def motion_of(trajectory: Trajectory, begin: float, seconds: float) -> Motion:
    """The motion along a part of a trajectory, evenly sampled and smoothed over half a second.

    Poses whose stamp steps back are left out, and so are jumps no robot makes.

    Raises
    ------
    UsageError
        The trajectory is shorter than asked.
    """
    stamps, poses = _in_order(trajectory)
    stamps = stamps - stamps[0] - begin
    if stamps[-1] < seconds:
        raise UsageError(
            f"the run lasts {stamps[-1] / 60.0:.1f} minutes from there on", "ask for fewer --minutes"
        )
    times = np.arange(0.0, seconds, _STEP)
    poses[:, 2] = np.unwrap(poses[:, 2])
    width = max(1, round(_SMOOTH / _STEP)) | 1
    sampled = np.stack([_smoothed(np.interp(times, stamps, poses[:, k]), width) for k in range(3)], axis=1)
    rates = np.gradient(sampled, _STEP, axis=0)
    return Motion(times, sampled, np.hypot(rates[:, 0], rates[:, 1]), rates[:, 2])


def _in_order(trajectory: Trajectory) -> tuple[FloatArray, FloatArray]:
    latest = np.maximum.accumulate(trajectory.stamps)
    fresh = np.r_[True, trajectory.stamps[1:] > latest[:-1]]
    stamps, poses = trajectory.stamps[fresh], trajectory.poses[fresh].copy()
    kept = [0]
    for k in range(1, len(stamps)):
        moved = math.hypot(*(poses[k, :2] - poses[kept[-1], :2]))
        if moved <= _FASTEST * (stamps[k] - stamps[kept[-1]]) + 0.05:
            kept.append(k)
    return stamps[kept], poses[kept]


def _smoothed(values: FloatArray, width: int) -> FloatArray:
    padded = np.pad(values, width // 2, mode="edge")
    return np.convolve(padded, np.full(width, 1.0 / width), mode="valid")


def world_of(grid: OccupancyMap, path: FloatArray) -> Iterator[FloatArray]:
    """Outlines (n, 2) of what is occupied, m: straight where the cells nearly are.

    Holes of one cell are closed, specks and what stands within the robot on its path are left out.
    """
    occupied = (grid.probability > 0.65).astype(np.uint8)
    occupied = cv2.morphologyEx(occupied, cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8)).astype(np.uint8)
    cells = np.floor((path - np.asarray(grid.origin)) / grid.resolution).astype(np.int64)
    track = np.zeros_like(occupied)
    inside = (cells >= 0).all(axis=1) & (cells < np.array(occupied.shape)[::-1]).all(axis=1)
    track[cells[inside, 1], cells[inside, 0]] = 1
    reach = math.ceil(_BODY / grid.resolution)
    body = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * reach + 1, 2 * reach + 1))
    occupied[cv2.dilate(track, body) > 0] = 0
    for outline in _outlines(occupied):
        yield np.asarray(grid.origin) + (outline + 0.5) * grid.resolution


def _outlines(occupied: NDArray[np.uint8]) -> Iterator[FloatArray]:
    count, labels, stats, _ = cv2.connectedComponentsWithStats(occupied, connectivity=8)
    sizes = np.asarray(stats)[:, cv2.CC_STAT_AREA]
    kept = np.isin(labels, np.flatnonzero(sizes >= _SMALLEST)) & (occupied > 0) if count > 1 else occupied > 0
    contours, _ = cv2.findContours(kept.astype(np.uint8), cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
    for contour in contours:
        corners = cv2.approxPolyDP(contour, _STRAIGHT, closed=True).reshape(-1, 2)
        if len(corners) >= 2:
            yield corners.astype(np.float64)


def scene_of(grid: OccupancyMap, motion: Motion, start: float, name: str) -> Scene:
    """A scene whose walls are the outlines of a map.

    Raises
    ------
    UsageError
        The map holds no walls.
    """
    path = motion.poses[:, :2]
    walls = [
        {
            "name": f"outline-{k}",
            "material": "plaster",
            "points": outline.tolist(),
            "closed": len(outline) > 2,
        }
        for k, outline in enumerate(world_of(grid, path))
    ]
    if not walls:
        raise UsageError("the map holds no walls", "name the results of a longer run")
    ends = [{"at": path[0].tolist()}, {"at": (path[-1] + 0.1).tolist()}]
    return Scene.model_validate(
        {"name": name, "walls": walls, "drive": {"waypoints": ends}, "start_time": round(start, 6)}
    )


def sonars_of(tour: Tour) -> SonarModel:
    """The ring, so many of its sonars fired together that it makes the sweeps in time.

    Raises
    ------
    UsageError
        Sound is too slow for so many sweeps.
    """
    model, sweep = sonar_model(tour.ring), 60.0 * tour.minutes / tour.sweeps
    groups = min(len(model.ring.poses), int(sweep / _PING + 1e-9))
    if groups < 1:
        raise UsageError(f"a sweep of {sweep:.3f} s is too short for sound", "ask for fewer --sweeps")
    together = math.ceil(len(model.ring.poses) / groups)
    model = replace(model, fired_together=together)
    return replace(model, firing_period=sweep / len(model.groups()))


def record(results: Path, folder: Path, tour: Tour) -> None:
    """Write the recording of a tour and say what it is."""
    trajectory, grid = read_tum(results / "trajectory.tum"), read_map(results)
    motion = motion_of(trajectory, tour.begin, 60.0 * tour.minutes)
    scene = scene_of(grid, motion, float(trajectory.stamps[0]) + tour.begin, f"tour of {results.name}")
    model = sonars_of(tour)
    simulation = simulate_along(scene, motion, tour.lidar, tour.seed, tour.rate, model)
    written = write_recording(simulation, folder / "tour.bag")
    # what the tour leaves out no map can show
    write_true_map(true_map(simulation, seen=True), truth_paths(written.bag))
    print(
        f"{written.scans} scans of a {simulation.sensor.name}, "
        f"{math.ceil(motion.times[-1] / model.sweep_period)} sweeps of {len(model.ring.poses)} sonars "
        f"({model.fired_together} fired together every {1000 * model.firing_period:.0f} ms), "
        f"{simulation.driven:.0f} m in {motion.times[-1] / 60.0:.1f} min, "
        f"{len(simulation.plan.segments)} surfaces"
    )
    print(f"wrote {written.bag} and its truth {written.true_map}, {written.true_trajectory}")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the program."""
    usual = Tour()
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("results", type=Path, metavar="DIR", help="results of glassslam map on a long log")
    parser.add_argument(
        "-o", "--output", type=Path, required=True, metavar="DIR", help="where the bag is written"
    )
    parser.add_argument(
        "--minutes", type=float, default=usual.minutes, help="length of the tour [%(default)s]"
    )
    parser.add_argument("--begin", type=float, default=usual.begin, metavar="S", help="where it begins, s")
    parser.add_argument("--sweeps", type=int, default=usual.sweeps, help="sonar sweeps in all [%(default)s]")
    parser.add_argument("--lidar", default=usual.lidar, help="lidar model [%(default)s]")
    parser.add_argument("--rate", type=float, default=usual.rate, help="scans per second [%(default)s]")
    parser.add_argument("--ring", default=usual.ring, help="ring of sonars [%(default)s]")
    parser.add_argument("--seed", type=int, default=usual.seed, help="seed of all noise [%(default)s]")
    words = vars(parser.parse_args(arguments))
    results, folder = words.pop("results"), words.pop("output")
    try:
        record(results, folder, Tour(**words))
    except GlassSlamError as error:
        print(f"error: {error.message}" + (f" ({error.hint})" if error.hint else ""), file=sys.stderr)
        return error.exit_code
    return 0


if __name__ == "__main__":
    sys.exit(main())
