"""A recording that was never made: scans and odometry of a robot in a scene, and the truth."""

import heapq
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from glassslam.errors import ConfigError, UsageError
from glassslam.geometry import compose, wrap_angle
from glassslam.records import Float32Array, FloatArray, LaserScan, PointSet, RangeRing, Record, Trajectory
from glassslam.simulation.drive import Motion, drive_path
from glassslam.simulation.echo import Observation, Optics
from glassslam.simulation.floorplan import FloorPlan, build_floor_plan
from glassslam.simulation.odometry import odometry_records
from glassslam.simulation.people import Crowd, feet
from glassslam.simulation.raycast import clearance
from glassslam.simulation.scene import Scene
from glassslam.simulation.sensors import LidarModel, lidar
from glassslam.simulation.sonar import SonarArray, sonar_records
from glassslam.simulation.sonar_models import SonarModel, sonar_model
from glassslam.simulation.ultrasonic import Ear, ultrasonic_records


@dataclass(frozen=True, slots=True)
class Simulation:
    """A scene, a lidar and a seed, ready to be recorded.

    Attributes
    ----------
    scene : Scene
        The world.
    sensor : LidarModel
        The lidar.
    seed : int
        Same scene, sensor and seed: same records.
    motion : Motion
        The true motion of the robot base.
    plan : FloorPlan
        Every surface, for the truth and for drawing.
    truth : Trajectory
        True pose of the base at the stamp of every scan, world frame.
    sonar : SonarModel or None
        The ring of sonars; None when the robot has none.
    """

    scene: Scene
    sensor: LidarModel
    seed: int
    motion: Motion
    plan: FloorPlan
    truth: Trajectory
    sonar: SonarModel | None = None

    @property
    def driven(self) -> float:
        """Length of the path, m."""
        return float(np.hypot(*np.diff(self.motion.poses[:, :2], axis=0).T).sum())

    def records(self, watch: Callable[[Observation], None] | None = None) -> Iterator[Record]:
        """Scans, odometry, sonar readings and ultrasonic points in the order in which they would be recorded.

        Parameters
        ----------
        watch : callable, optional
            Called with the truth of every scan, in the order of `truth`, before the scan is given out.
        """
        scene = self.scene
        odometry = odometry_records(self.motion, scene.odometry, self.seed, scene.start_time)
        streams: list[Iterator[Record]] = [odometry, self._scans(watch), self._readings(), self._points()]
        return heapq.merge(*streams, key=lambda record: record.record_stamp)

    def _readings(self) -> Iterator[RangeRing]:
        if self.sonar is None:
            return iter(())
        scene = self.scene
        array = SonarArray.build(self.plan, scene.palette(), self.sonar)
        return sonar_records(array, self.motion, Crowd.of(scene), self.seed, scene.start_time)

    def _points(self) -> Iterator[PointSet]:
        mount = self.scene.ultrasonic
        if mount is None:
            return iter(())
        ear = Ear.build(self.scene, mount)
        return ultrasonic_records(ear, self.motion, self.seed, self.scene.start_time)

    def _scans(self, watch: Callable[[Observation], None] | None) -> Iterator[LaserScan]:
        sensor, random = self.sensor, np.random.default_rng([self.seed, 0])
        optics = Optics.build(self.plan, self.scene.palette(), sensor)
        crowd = Crowd.of(self.scene)
        instants = np.arange(sensor.beams, dtype=np.float64) * sensor.time_increment
        for stamp in self.truth.stamps:
            time = float(stamp) - self.scene.start_time
            # Every beam leaves from where the laser is at its own instant: that is motion distortion.
            lasers = compose(self.motion.at(time + instants), np.array(self.scene.laser_pose))
            seen = optics.observe(lasers, crowd.legs(time, max(sensor.sweep, 1e-3)), random)
            if watch is not None:
                watch(seen)
            yield self._scan(float(stamp), seen.ranges, seen.intensities)

    def _scan(self, stamp: float, ranges: Float32Array, intensities: Float32Array) -> LaserScan:
        sensor = self.sensor
        return LaserScan(
            stamp=stamp,
            ranges=ranges,
            angle_min=sensor.angle_min,
            angle_increment=sensor.angle_increment,
            range_min=sensor.range_min,
            range_max=sensor.range_max,
            time_increment=sensor.time_increment,
            intensities=intensities,
            frame_id="laser",
            record_stamp=stamp + sensor.sweep + sensor.transfer_delay,
        )


def simulate(
    scene: Scene,
    sensor: str | LidarModel | None = None,
    seed: int = 0,
    scan_rate: float | None = None,
    sonar: str | SonarModel | None = None,
) -> Simulation:
    """Drive the robot of a scene and prepare its recording.

    Parameters
    ----------
    scene : Scene
        The world.
    sensor : str or LidarModel, optional
        The lidar or its name; the scene's own when omitted.
    seed : int
        Seed of all noise.
    scan_rate : float, optional
        Scans recorded per second; the scene's own, or all of the lidar, when omitted.
    sonar : str or SonarModel, optional
        The ring of sonars or its name; no sonars when omitted.

    Raises
    ------
    UsageError
        There is no such lidar or ring, or the lidar does not turn that fast.
    ConfigError
        The floor plan is contradictory, or the robot would run into something.
    """
    motion = drive_path(scene.drive)
    simulation = simulate_along(scene, motion, sensor, seed, scan_rate, sonar)
    _check_clear(scene, build_floor_plan(scene, (0.0, scene.robot_height)), motion)
    _check_people(scene, motion)
    return simulation


def simulate_along(
    scene: Scene,
    motion: Motion,
    sensor: str | LidarModel | None = None,
    seed: int = 0,
    scan_rate: float | None = None,
    sonar: str | SonarModel | None = None,
) -> Simulation:
    """Prepare the recording of a robot that moves in a given way, wherever that leads it.

    Parameters
    ----------
    motion : Motion
        The true motion of the base, as another robot may have driven; the drive of the scene is not used.
    scene, sensor, seed, scan_rate, sonar
        As for `simulate`.

    Raises
    ------
    UsageError
        There is no such lidar or ring, or the lidar does not turn that fast.
    ConfigError
        The floor plan is contradictory.
    """
    model = sensor if isinstance(sensor, LidarModel) else lidar(sensor or scene.sensor)
    model = _thinned(model, scan_rate, scene.scan_rate)
    ring = sonar_model(sonar) if isinstance(sonar, str) else sonar
    plan = build_floor_plan(scene)
    return Simulation(scene, model, seed, motion, plan, _truth(scene, model, motion), ring)


def _thinned(model: LidarModel, asked: float | None, of_scene: float | None) -> LidarModel:
    """The lidar with fewer scans published; a scene's own rate is a limit, one asked for must be met."""
    rate = asked if asked is not None else of_scene
    if rate is None or (asked is None and rate * model.scan_period >= 1.0):
        return model
    if not rate > 0.0 or rate * model.scan_period > 1.0 + 1e-9:
        raise UsageError(
            f"a {model.name} does not give {rate:g} scans per second",
            f"choose a rate above 0, at most {1 / model.scan_period:g}",
        )
    return replace(model, scan_period=1.0 / rate)


def _truth(scene: Scene, sensor: LidarModel, motion: Motion) -> Trajectory:
    end = float(motion.times[-1]) - sensor.sweep
    offsets: FloatArray = np.arange(0.0, end, sensor.scan_period)
    # Whole microseconds: what a float64 of this size can tell apart and a bag gives back unchanged.
    stamps = np.round(scene.start_time + offsets, 6)
    poses = motion.at(stamps - scene.start_time)
    poses[:, 2] = wrap_angle(poses[:, 2])
    return Trajectory(stamps=stamps, poses=poses)


def _check_clear(scene: Scene, plan: FloorPlan, motion: Motion) -> None:
    every = max(1, len(motion.times) // 4000)
    positions = motion.poses[::every, :2]
    distances = clearance(positions, plan.segments)
    worst = int(np.argmin(distances))
    if distances[worst] < scene.drive.radius:
        x, y = positions[worst]
        raise ConfigError(
            f"drive: the robot comes within {distances[worst]:.2f} m of something at ({x:.2f}, {y:.2f})",
            f"move a way point; its radius is {scene.drive.radius:g} m",
        )


def _check_people(scene: Scene, motion: Motion) -> None:
    """Nobody walks through the robot: its laser would stand inside a leg."""
    if not scene.people:
        return
    radii = np.repeat([person.leg_radius for person in scene.people], 2)
    every = round(0.1 / float(motion.times[1]))
    for time, pose in zip(motion.times[::every], motion.poses[::every], strict=True):
        gaps = np.hypot(*(feet(scene.people, float(time)) - pose[:2]).T) - radii
        nearest = int(np.argmin(gaps))
        if gaps[nearest] < scene.drive.radius:
            name = scene.people[nearest // 2].name
            raise ConfigError(
                f"people: {name!r} walks into the robot after {time:.1f} s at ({pose[0]:.2f}, {pose[1]:.2f})",
                "move the line walked, or change `start`",
            )
