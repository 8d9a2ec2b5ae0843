"""A recording that was never made: scans and odometry of a robot in a scene, and the truth."""

import heapq
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from glassslam.errors import ConfigError
from glassslam.geometry import compose, wrap_angle
from glassslam.records import Float32Array, FloatArray, LaserScan, Record, Trajectory
from glassslam.simulation.drive import Motion, drive_path
from glassslam.simulation.echo import echoes
from glassslam.simulation.floorplan import FloorPlan, build_floor_plan
from glassslam.simulation.odometry import odometry_records
from glassslam.simulation.raycast import SegmentGrid, clearance
from glassslam.simulation.scene import Scene
from glassslam.simulation.sensors import LidarModel, lidar


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
    """

    scene: Scene
    sensor: LidarModel
    seed: int
    motion: Motion
    plan: FloorPlan
    truth: Trajectory

    @property
    def driven(self) -> float:
        """Length of the path, m."""
        return float(np.hypot(*np.diff(self.motion.poses[:, :2], axis=0).T).sum())

    def records(self) -> Iterator[Record]:
        """Scans and odometry in the order in which they would be recorded."""
        scene = self.scene
        odometry = odometry_records(self.motion, scene.odometry, self.seed, scene.start_time)
        return heapq.merge(odometry, self._scans(), key=lambda record: record.record_stamp)

    def _scans(self) -> Iterator[LaserScan]:
        sensor, random = self.sensor, np.random.default_rng([self.seed, 0])
        grid = SegmentGrid.build(self.plan.segments)
        palette = self.scene.palette()
        reflectance = np.array([palette[self.plan.materials[m]].reflectance for m in self.plan.material])
        beam = np.arange(sensor.beams)
        bearing = sensor.angle_min + beam * sensor.angle_increment
        for stamp in self.truth.stamps:
            # Every beam leaves from where the laser is at its own instant: that is motion distortion.
            base = self.motion.at(stamp - self.scene.start_time + beam * sensor.time_increment)
            laser = compose(base, np.array(self.scene.laser_pose))
            hits = grid.cast(laser[:, :2], laser[:, 2] + bearing)
            ranges, intensities = echoes(hits, reflectance[hits.segment], sensor, random)
            yield self._scan(float(stamp), ranges, intensities)

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


def simulate(scene: Scene, sensor: str | LidarModel | None = None, seed: int = 0) -> Simulation:
    """Drive the robot of a scene and prepare its recording.

    Parameters
    ----------
    scene : Scene
        The world.
    sensor : str or LidarModel, optional
        The lidar or its name; the scene's own when omitted.
    seed : int
        Seed of all noise.

    Raises
    ------
    UsageError
        There is no such lidar.
    ConfigError
        The floor plan is contradictory, or the robot would run into something.
    """
    model = sensor if isinstance(sensor, LidarModel) else lidar(sensor or scene.sensor)
    plan = build_floor_plan(scene)
    motion = drive_path(scene.drive)
    _check_clear(scene, plan, motion)
    return Simulation(scene, model, seed, motion, plan, _truth(scene, model, motion))


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
