"""A simulation put on disk: the bag, and the truth beside it."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from glassslam.records import Record
from glassslam.simulation.rosbag1 import write_rosbag1
from glassslam.simulation.simulate import Simulation
from glassslam.simulation.truth import truth_paths, write_truth
from glassslam.simulation.truth_log import TruthLog


@dataclass(frozen=True, slots=True)
class WrittenRecording:
    """What was written.

    Attributes
    ----------
    bag, true_trajectory, true_plan : Path
        The recording, the true poses (TUM) and the true surfaces (JSON).
    true_labels, true_glass : Path
        What every beam met (npz) and the panes (GeoJSON).
    true_map, true_image, true_classes : Path
        The true map (map_server YAML and PGM) and the class of its cells (PNG).
    scans : int
        Number of scans in the bag.
    """

    bag: Path
    true_trajectory: Path
    true_plan: Path
    true_labels: Path
    true_glass: Path
    true_map: Path
    true_image: Path
    true_classes: Path
    scans: int


def write_recording(
    simulation: Simulation, bag: str | Path, progress: Callable[[float], None] | None = None
) -> WrittenRecording:
    """Write the bag of a simulation and the truth beside it, all or nothing; existing files are replaced.

    Parameters
    ----------
    simulation : Simulation
        What to record.
    bag : str or Path
        Name of the ROS1 bag.
    progress : callable, optional
        Called with the recorded time so far, s.

    Raises
    ------
    OutputError
        A file cannot be written.
    """
    start = simulation.scene.start_time

    def report(record: Record) -> None:
        if progress is not None:
            progress(record.stamp - start)

    log = TruthLog(simulation.plan.segments)
    ring = None if simulation.sonar is None else simulation.sonar.ring
    scene, mount = simulation.scene, simulation.scene.ultrasonic
    # Recordings without the sensor know nothing of heights.
    heights: dict[str, Any] = {}
    if mount is not None:
        x, y, yaw = mount.pose
        heights = {"ultrasonic": (x, y, mount.height, yaw), "laser_height": scene.laser_height}

    # Before the bag changes: a bag without a truth is one, a bag beside the truth of another is a trap.
    def forget() -> None:
        for stale in truth_paths(bag):
            stale.unlink(missing_ok=True)

    records = simulation.records(log.add)
    scans = write_rosbag1(records, bag, scene.laser_pose, report, ring, **heights, replacing=forget)
    try:
        truth = write_truth(simulation, bag, log)
    except (Exception, KeyboardInterrupt):
        forget()
        Path(bag).unlink()
        raise
    return WrittenRecording(Path(bag), *truth, scans=scans)
