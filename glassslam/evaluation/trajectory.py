"""Errors of a trajectory against a reference trajectory: ATE after alignment, RPE over steps."""

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from glassslam.errors import EvaluationError
from glassslam.geometry import between, compose, inverse, wrap_angle
from glassslam.records import FloatArray, Trajectory

StepUnit: TypeAlias = Literal["poses", "metres"]
LARGEST_DIFFERENCE = 0.01


@dataclass(frozen=True, slots=True)
class ErrorSummary:
    """Statistics of one kind of error; the deviation is that of the whole population."""

    rmse: float
    mean: float
    median: float
    std: float
    min: float
    max: float

    @classmethod
    def of(cls, errors: FloatArray) -> "ErrorSummary":
        """Statistics of one or more errors, shape (n,)."""
        return cls(
            rmse=float(np.sqrt(np.mean(errors**2))),
            mean=float(errors.mean()),
            median=float(np.median(errors)),
            std=float(errors.std()),
            min=float(errors.min()),
            max=float(errors.max()),
        )


@dataclass(frozen=True, slots=True)
class PoseErrors:
    """Translational error in m, rotational error in deg, over `count` poses or pairs."""

    count: int
    translation: ErrorSummary
    rotation: ErrorSummary


def associate(
    estimate: Trajectory, reference: Trajectory, *, largest_difference: float = LARGEST_DIFFERENCE
) -> tuple[FloatArray, FloatArray]:
    """Pair the poses of two trajectories by time: each pose of the shorter one with the nearest other.

    Parameters
    ----------
    estimate, reference : Trajectory
        Stamped poses, in any order.
    largest_difference : float
        Largest difference of paired stamps, s.

    Returns
    -------
    estimated, true : ndarray of float64, shape (n, 3)
        The paired poses, in the order of the shorter trajectory.

    Raises
    ------
    EvaluationError
        No two stamps are near enough.
    """
    if estimate.stamps.size <= reference.stamps.size:
        own, other = _nearest(estimate.stamps, reference.stamps, largest_difference)
    else:
        other, own = _nearest(reference.stamps, estimate.stamps, largest_difference)
    if not own.size:
        raise EvaluationError(
            f"no pose of the trajectory is within {largest_difference} s of one of the reference",
            f"the trajectory spans {estimate.stamps.min():.3f} to {estimate.stamps.max():.3f} s, "
            f"the reference {reference.stamps.min():.3f} to {reference.stamps.max():.3f} s",
        )
    return estimate.poses[own], reference.poses[other]


def _nearest(
    short: FloatArray, long: FloatArray, largest_difference: float
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    order = np.argsort(long, kind="stable")
    known = long[order]
    after = np.searchsorted(known, short, side="right").clip(0, known.size - 1)
    before = (after - 1).clip(0)
    pick = np.where(np.abs(short - known[before]) <= np.abs(known[after] - short), before, after)
    kept = np.flatnonzero(np.abs(known[pick] - short) <= largest_difference)
    return kept, order[pick[kept]]


def align(estimated: FloatArray, true: FloatArray) -> FloatArray:
    """Rigid motion that brings positions nearest to the true ones (Umeyama 1991, without scale).

    Parameters
    ----------
    estimated, true : ndarray of float64, shape (n, 3)
        Paired poses; only their positions are used.

    Returns
    -------
    ndarray of float64, shape (3,)
        `true_from_estimated`, m and rad; where all positions coincide, it does not turn.
    """
    mean_estimated, mean_true = estimated[:, :2].mean(axis=0), true[:, :2].mean(axis=0)
    a, b = estimated[:, :2] - mean_estimated, true[:, :2] - mean_true
    theta = np.arctan2(np.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]), np.sum(a * b))
    turned = compose(np.array([0.0, 0.0, theta]), np.array([*mean_estimated, 0.0]))
    return np.array([*(mean_true - turned[:2]), theta])


def absolute_trajectory_error(
    estimate: Trajectory, reference: Trajectory, *, largest_difference: float = LARGEST_DIFFERENCE
) -> PoseErrors:
    """Error of the poses (ATE) after the best rigid alignment of the positions.

    Parameters
    ----------
    estimate, reference : Trajectory
        Trajectories of the same body; frames may differ by a rigid motion.
    largest_difference : float
        Largest difference of paired stamps, s.

    Returns
    -------
    PoseErrors
        Distances in m, absolute heading differences in deg.

    Raises
    ------
    EvaluationError
        No two stamps are near enough.

    Examples
    --------
    >>> import numpy as np
    >>> from glassslam import Trajectory, absolute_trajectory_error
    >>> stamps = np.arange(3.0)
    >>> truth = Trajectory(stamps, np.array([[0.0, 0, 0], [1.0, 0, 0], [2.0, 0, 0]]))
    >>> moved = Trajectory(stamps, truth.poses + [5.0, 5.0, 0.0])
    >>> absolute_trajectory_error(moved, truth).translation.rmse
    0.0
    """
    estimated, true = associate(estimate, reference, largest_difference=largest_difference)
    aligned = compose(align(estimated, true), estimated)
    distance = np.hypot(*(aligned - true)[:, :2].T)
    angle = np.rad2deg(np.abs(wrap_angle(aligned[:, 2] - true[:, 2])))
    return PoseErrors(len(true), ErrorSummary.of(distance), ErrorSummary.of(angle))


def relative_pose_error(
    estimate: Trajectory,
    reference: Trajectory,
    *,
    step: float = 1.0,
    unit: StepUnit = "poses",
    largest_difference: float = LARGEST_DIFFERENCE,
) -> PoseErrors:
    """Error of the motion (RPE) over consecutive, not overlapping steps.

    Parameters
    ----------
    estimate, reference : Trajectory
        Trajectories of the same body.
    step : float
        Length of a step, in the unit.
    unit : {"poses", "metres"}
        Count paired poses, or distance travelled by the reference.
    largest_difference : float
        Largest difference of paired stamps, s.

    Returns
    -------
    PoseErrors
        Distances in m, absolute angles in deg; `count` is the number of steps.

    Raises
    ------
    EvaluationError
        No two stamps are near enough, or the trajectory is shorter than one step.
    """
    estimated, true = associate(estimate, reference, largest_difference=largest_difference)
    marks = _every_metres(true, step) if unit == "metres" else np.arange(0, len(true), max(int(step), 1))
    if marks.size < 2:
        raise EvaluationError(f"the paired trajectory is shorter than one step of {step:g} {unit}")
    estimated_motion = between(estimated[marks[:-1]], estimated[marks[1:]])
    true_motion = between(true[marks[:-1]], true[marks[1:]])
    error = compose(inverse(true_motion), estimated_motion)
    return PoseErrors(
        marks.size - 1,
        ErrorSummary.of(np.hypot(error[:, 0], error[:, 1])),
        ErrorSummary.of(np.rad2deg(np.abs(error[:, 2]))),
    )


def _every_metres(poses: FloatArray, step: float) -> NDArray[np.intp]:
    marks, travelled = [0], 0.0
    for index, length in enumerate(np.hypot(*np.diff(poses[:, :2], axis=0).T).tolist(), start=1):
        travelled += length
        if travelled >= step:
            marks.append(index)
            travelled = 0.0
    return np.array(marks, dtype=np.intp)
