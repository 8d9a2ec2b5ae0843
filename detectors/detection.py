"""What a detector says about one scan."""

from dataclasses import dataclass, fields
from typing import Any, Self, TypeAlias

import numpy as np
from numpy.typing import NDArray

FloatArray: TypeAlias = NDArray[np.float64]
IntArray: TypeAlias = NDArray[np.int64]
LabelArray: TypeAlias = NDArray[np.uint8]

COLUMNS = (
    "range",
    "bearing",
    "normal",
    "incidence",
    "strength",
    "probability",
    "position_sigma",
    "normal_sigma",
    "extent",
)


@dataclass(frozen=True, slots=True, eq=False)
class Detection:
    """Glass seen in one scan: one entry per observation, in the laser frame, and one label per beam.

    Attributes
    ----------
    beam : ndarray of int64, shape (k,)
        Index of the centre beam of the observed piece of pane.
    range : ndarray of float64, shape (k,)
        Range of the piece along its centre beam, m.
    bearing : ndarray of float64, shape (k,)
        Angle of the centre beam, rad.
    normal : ndarray of float64, shape (k,)
        Direction from the sensor to the surface along its normal, rad: the bearing at normal incidence.
    incidence : ndarray of float64, shape (k,)
        Angle between the centre beam and the normal, rad, never negative.
    strength : ndarray of float64, shape (k,)
        Strength of the evidence in the unit of the detector, which its documentation states.
    probability : ndarray of float64, shape (k,)
        Probability that the piece is glass, 0..1.
    position_sigma : ndarray of float64, shape (k,)
        Standard deviation of the position along the normal, m.
    normal_sigma : ndarray of float64, shape (k,)
        Standard deviation of the direction of the normal, rad.
    extent : ndarray of float64, shape (k,)
        Half width of the piece of pane that the observation proves, m.
    labels : ndarray of uint8, shape (n,)
        Label of every beam of the scan; see `detectors.labels`.

    Raises
    ------
    ValueError
        The columns differ in length.
    """

    beam: IntArray
    range: FloatArray
    bearing: FloatArray
    normal: FloatArray
    incidence: FloatArray
    strength: FloatArray
    probability: FloatArray
    position_sigma: FloatArray
    normal_sigma: FloatArray
    extent: FloatArray
    labels: LabelArray

    def __post_init__(self) -> None:
        for name in COLUMNS:
            if getattr(self, name).shape != self.beam.shape:
                raise ValueError(f"{name} has {getattr(self, name).size} entries for {self.beam.size} beams")

    def __len__(self) -> int:
        return int(self.beam.size)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Detection):
            return NotImplemented
        return all(np.array_equal(getattr(self, f.name), getattr(other, f.name)) for f in fields(self))

    __hash__ = None  # type: ignore[assignment]

    @property
    def positions(self) -> FloatArray:
        """End points of the observations in the laser frame, m, shape (k, 2)."""
        return np.column_stack((self.range * np.cos(self.bearing), self.range * np.sin(self.bearing)))

    def select(self, keep: Any) -> Self:
        """Keep some observations and all labels.

        Parameters
        ----------
        keep : ndarray of bool or int
            Mask or indices of the observations kept.
        """
        columns: dict[str, FloatArray] = {name: getattr(self, name)[keep] for name in COLUMNS}
        return type(self)(beam=self.beam[keep], labels=self.labels, **columns)


def from_table(beam: IntArray, table: FloatArray, labels: LabelArray) -> Detection:
    """Build a detection from a kernel's table, one row per observation, columns in the order of `COLUMNS`."""
    columns = dict(zip(COLUMNS, np.ascontiguousarray(table.T), strict=True))
    return Detection(beam=beam, labels=labels, **columns)
