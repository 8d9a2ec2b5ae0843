"""How observations change a cell: the update of Hess et al. 2016, section IV-B, in log odds."""

import math
from dataclasses import dataclass

import numpy as np

from glassslam.errors import GridError
from glassslam.records import Float32Array

LOG_ODDS_STEP = 1e-3
"""Log odds between two neighbouring cell values."""
_LARGEST_VALUE = np.iinfo(np.uint16).max


def log_odds(probability: float) -> float:
    """Natural logarithm of p / (1 - p)."""
    return math.log(probability / (1.0 - probability))


@dataclass(frozen=True, slots=True)
class OddsModel:
    """How observations change a cell.

    Adding log odds is the published update M_new = clamp(odds^-1(odds(M_old) * odds(p))) with
    odds(p) = p / (1 - p); a cell never observed starts from even odds.

    Attributes
    ----------
    hit_probability, miss_probability : float
        P(occupied) after one return in, or one ray through, a cell of even odds.
    lower_probability, upper_probability : float
        Clamp of the cells.
    unknown_probability : float
        What a cell never observed reads as in scan matching.

    Raises
    ------
    GridError
        A probability on the wrong side of even odds, or so near 0 or 1 that cells cannot hold it.

    Examples
    --------
    >>> model = OddsModel(hit_probability=0.55)
    >>> round(float(model.table()[model.prior + model.hit_step]), 3)
    0.55
    """

    hit_probability: float = 0.55
    miss_probability: float = 0.49
    lower_probability: float = 0.12
    upper_probability: float = 0.98
    unknown_probability: float = 0.5

    def __post_init__(self) -> None:
        checks = (
            ("hit_probability", 0.5 <= self.hit_probability < 1.0, "from 0.5 to below 1"),
            ("miss_probability", 0.0 < self.miss_probability <= 0.5, "above 0, at most 0.5"),
            ("lower_probability", 0.0 < self.lower_probability < 0.5, "between 0 and 0.5"),
            ("upper_probability", 0.5 < self.upper_probability < 1.0, "between 0.5 and 1"),
            ("unknown_probability", 0.0 < self.unknown_probability < 1.0, "between 0 and 1"),
        )
        for name, fine, limits in checks:
            if not fine:
                raise GridError(f"{name} is {getattr(self, name)}", f"it must be {limits}")
        if self.locked > _LARGEST_VALUE:
            raise GridError(
                f"cells cannot span {self.lower_probability} to {self.upper_probability}",
                "keep the clamp away from 0 and 1",
            )

    @property
    def hit_step(self) -> int:
        """Change of a cell value by a hit."""
        return round(log_odds(self.hit_probability) / LOG_ODDS_STEP)

    @property
    def miss_step(self) -> int:
        """Change of a cell value by a miss."""
        return round(log_odds(self.miss_probability) / LOG_ODDS_STEP)

    @property
    def prior(self) -> int:
        """Cell value of even odds."""
        return 1 + round(-log_odds(self.lower_probability) / LOG_ODDS_STEP)

    @property
    def top(self) -> int:
        """Largest cell value."""
        span = log_odds(self.upper_probability) - log_odds(self.lower_probability)
        return 1 + round(span / LOG_ODDS_STEP)

    @property
    def locked(self) -> int:
        """Value of a locked cell, which observations no longer change."""
        return self.top + 1

    def table(self) -> Float32Array:
        """P(occupied) of every cell value, shape (top + 2,); entry 0 is that of unknown cells.

        The last entry is that of locked cells: the upper clamp.
        """
        odds = log_odds(self.lower_probability) + LOG_ODDS_STEP * np.arange(self.top)
        known = 1.0 / (1.0 + np.exp(-odds))
        return np.concatenate(([self.unknown_probability], known, known[-1:])).astype(np.float32)
