"""The relation metric of Kuemmerle et al. 2009, "On measuring the accuracy of SLAM algorithms"."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from glassslam.errors import EvaluationError
from glassslam.evaluation.lookup import LARGEST_GAP, STAMP_TOLERANCE, poses_at
from glassslam.geometry import between, compose, inverse
from glassslam.outputs.table import read_table
from glassslam.records import FloatArray, Trajectory

COLUMNS = ("t1", "t2", "x", "y", "z", "roll", "pitch", "yaw")


@dataclass(frozen=True, slots=True)
class Relations:
    """True relative poses between pairs of times.

    Attributes
    ----------
    first, second : ndarray of float64, shape (n,)
        The two times, s.
    first_from_second : ndarray of float64, shape (n, 3)
        Pose (x, y, theta) at the second time in the frame of the first, m and rad.
    """

    first: FloatArray
    second: FloatArray
    first_from_second: FloatArray


@dataclass(frozen=True, slots=True)
class Spread:
    """Mean and sample standard deviation of an error."""

    mean: float
    std: float

    @classmethod
    def of(cls, values: FloatArray) -> "Spread":
        """Statistics of one or more values, shape (n,); the deviation of a single value is 0."""
        return cls(float(values.mean()), float(values.std(ddof=1)) if values.size > 1 else 0.0)


@dataclass(frozen=True, slots=True)
class RelationErrors:
    """How far a trajectory is from its relations.

    Attributes
    ----------
    count, unmatched : int
        Relations compared; relations without a pose at one of their times.
    translation, translation_squared : Spread
        Distance, m, and its square, m^2.
    rotation, rotation_squared : Spread
        Absolute angle, deg, and its square, deg^2.
    """

    count: int
    unmatched: int
    translation: Spread
    translation_squared: Spread
    rotation: Spread
    rotation_squared: Spread


def read_relations(path: str | Path) -> Relations:
    """Read a relation file; of each relation the planar part x, y, yaw is kept.

    Parameters
    ----------
    path : str or Path
        A file of lines `t1 t2 x y z roll pitch yaw` (s, m, rad): pose of t2 in the frame of t1.

    Returns
    -------
    Relations
        In the order of the file.

    Raises
    ------
    EvaluationError
        The file cannot be read, is empty, or holds a line that is no relation.
    """
    rows = read_table(path, COLUMNS, EvaluationError)
    return Relations(rows[:, 0].copy(), rows[:, 1].copy(), rows[:, (2, 3, 7)])


def evaluate_relations(
    trajectory: Trajectory,
    relations: Relations,
    *,
    tolerance: float = STAMP_TOLERANCE,
    largest_gap: float = LARGEST_GAP,
    cartographer: bool = False,
) -> RelationErrors:
    """Compare the relative poses of a trajectory with the true ones, inv(true) * estimated.

    Parameters
    ----------
    trajectory : Trajectory
        The estimate; see `poses_at` for how times find their poses.
    relations : Relations
        The truth.
    tolerance, largest_gap : float
        Limits of finding a pose, s; see `poses_at`.
    cartographer : bool
        Take estimated * inv(true) instead, as Cartographer's tool does: it turns the error of the
        heading into a translation along the lever arm of the relation.

    Returns
    -------
    RelationErrors
        Translational error in m, rotational in deg.

    Raises
    ------
    EvaluationError
        No relation has poses at both of its times.

    Examples
    --------
    >>> import numpy as np
    >>> from glassslam import Relations, Trajectory, evaluate_relations
    >>> driven = Trajectory(np.array([0.0, 1.0]), np.array([[0.0, 0.0, 0.0], [1.1, 0.0, 0.0]]))
    >>> truth = Relations(np.array([0.0]), np.array([1.0]), np.array([[1.0, 0.0, 0.0]]))
    >>> round(evaluate_relations(driven, truth).translation.mean, 3)
    0.1
    """
    first, found_first = poses_at(trajectory, relations.first, tolerance=tolerance, largest_gap=largest_gap)
    second, found_second = poses_at(
        trajectory, relations.second, tolerance=tolerance, largest_gap=largest_gap
    )
    matched = found_first & found_second
    if not matched.any():
        raise _nothing_matched(trajectory, relations)
    estimated, true = between(first[matched], second[matched]), relations.first_from_second[matched]
    error = compose(estimated, inverse(true)) if cartographer else compose(inverse(true), estimated)
    distance, angle = np.hypot(error[:, 0], error[:, 1]), np.rad2deg(np.abs(error[:, 2]))
    return RelationErrors(
        count=int(matched.sum()),
        unmatched=int(matched.size - matched.sum()),
        translation=Spread.of(distance),
        translation_squared=Spread.of(distance**2),
        rotation=Spread.of(angle),
        rotation_squared=Spread.of(angle**2),
    )


def _nothing_matched(trajectory: Trajectory, relations: Relations) -> EvaluationError:
    asked = np.concatenate((relations.first, relations.second))
    return EvaluationError(
        f"none of the {relations.first.size} relations has poses at both of its times",
        f"the relations span {asked.min():.3f} to {asked.max():.3f} s, "
        f"the trajectory {trajectory.stamps.min():.3f} to {trajectory.stamps.max():.3f} s",
    )
