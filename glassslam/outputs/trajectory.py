"""Trajectories as TUM text: one line `t x y z qx qy qz qw` per pose."""

from pathlib import Path

import numpy as np

from glassslam.errors import OutputError
from glassslam.outputs.table import read_table
from glassslam.records import Trajectory

COLUMNS = ("t", "x", "y", "z", "qx", "qy", "qz", "qw")


def write_tum(trajectory: Trajectory, path: str | Path) -> Path:
    """Write every pose of the trajectory in its own order, 9 decimals, s and m.

    Parameters
    ----------
    trajectory : Trajectory
        Planar poses; z, qx and qy are written as 0.
    path : str or Path
        The file to write.

    Returns
    -------
    Path
        The file written.

    Raises
    ------
    OSError
        The file cannot be written.
    """
    half = 0.5 * trajectory.poses[:, 2]
    zero = np.zeros_like(half)
    rows = np.column_stack(
        (trajectory.stamps, trajectory.poses[:, :2], zero, zero, zero, np.sin(half), np.cos(half))
    )
    # What rounds to zero would otherwise be written as "-0.000000000" where it is negative.
    rows = np.where(np.abs(rows) < 0.5e-9, 0.0, rows)
    lines = (" ".join(format(value, ".9f") for value in row) for row in rows.tolist())
    target = Path(path)
    target.write_text("".join(f"{line}\n" for line in lines), encoding="ascii")
    return target


def read_tum(path: str | Path) -> Trajectory:
    """Read a TUM file; of 3D poses the position in the plane and the yaw are kept.

    Parameters
    ----------
    path : str or Path
        A file of lines `t x y z qx qy qz qw`, # starts a comment.

    Returns
    -------
    Trajectory
        The poses in the order of the file.

    Raises
    ------
    OutputError
        The file cannot be read, is empty, or holds a line that is no pose.
    """
    rows = read_table(path, COLUMNS, OutputError)
    norm = np.linalg.norm(rows[:, 4:], axis=1)
    if (bad := np.flatnonzero(norm < 1e-6)).size:
        raise OutputError(f"{path}: pose {bad[0] + 1} has a zero quaternion")
    qx, qy, qz, qw = (rows[:, 4:] / norm[:, None]).T
    yaw = np.arctan2(2.0 * (qw * qz + qx * qy), 1.0 - 2.0 * (qy * qy + qz * qz))
    return Trajectory(rows[:, 0].copy(), np.column_stack((rows[:, 1], rows[:, 2], yaw)))
