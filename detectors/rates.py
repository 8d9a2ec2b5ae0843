"""How sure a measured rate is."""

import math
from dataclasses import dataclass

NORMAL_95 = 1.959963984540054


@dataclass(frozen=True, slots=True)
class Rate:
    """A share of trials with its 95 % confidence interval.

    Attributes
    ----------
    successes, trials : int
        What was counted.
    value, low, high : float
        The share, and the interval after Wilson; 0 to 1 without trials.
    """

    successes: int
    trials: int
    value: float
    low: float
    high: float

    def to_dict(self) -> dict[str, float | int]:
        """Plain numbers, rounded for reading."""
        return {
            "successes": self.successes,
            "trials": self.trials,
            "value": round(self.value, 4),
            "low": round(self.low, 4),
            "high": round(self.high, 4),
        }


def wilson(successes: int, trials: int) -> Rate:
    """Rate of successes with its Wilson score interval.

    Parameters
    ----------
    successes, trials : int
        0 <= successes <= trials.

    Raises
    ------
    ValueError
        There are more successes than trials, or fewer than none.

    Examples
    --------
    >>> rate = wilson(12, 12)
    >>> rate.value, round(rate.low, 2), rate.high
    (1.0, 0.76, 1.0)
    """
    if not 0 <= successes <= trials:
        raise ValueError(f"{successes} successes in {trials} trials")
    if trials == 0:
        return Rate(0, 0, math.nan, 0.0, 1.0)
    share = successes / trials
    z2 = NORMAL_95 * NORMAL_95 / trials
    centre = (share + 0.5 * z2) / (1.0 + z2)
    half = NORMAL_95 * math.sqrt(share * (1.0 - share) / trials + 0.25 * z2 / trials) / (1.0 + z2)
    low = 0.0 if successes == 0 else max(0.0, centre - half)
    high = 1.0 if successes == trials else min(1.0, centre + half)
    return Rate(successes, trials, share, low, high)
