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
    independent : int
        Trials that tell something new; the interval rests on these.
    """

    successes: int
    trials: int
    value: float
    low: float
    high: float
    independent: int

    def to_dict(self) -> dict[str, float | int]:
        """Plain numbers, rounded for reading."""
        return {
            "successes": self.successes,
            "trials": self.trials,
            "independent": self.independent,
            "value": round(self.value, 4),
            "low": round(self.low, 4),
            "high": round(self.high, 4),
        }


def wilson(successes: int, trials: int, independent: int | None = None) -> Rate:
    """Rate of successes with its Wilson score interval.

    A lidar that stands still sees the same thing a thousand times: then the share is that of all trials, but
    the interval is that of as many trials as are independent.

    Parameters
    ----------
    successes, trials : int
        0 <= successes <= trials.
    independent : int, optional
        Number of independent ones among the trials; all when left out.

    Raises
    ------
    ValueError
        There are more successes than trials, or fewer than none; or more independent trials than trials.

    Examples
    --------
    >>> rate = wilson(12, 12)
    >>> rate.value, round(rate.low, 2), rate.high
    (1.0, 0.76, 1.0)
    >>> round(wilson(300, 300, independent=2).low, 2)
    0.34
    """
    if not 0 <= successes <= trials:
        raise ValueError(f"{successes} successes in {trials} trials")
    count = trials if independent is None else independent
    if not 0 <= count <= trials or (trials and not count):
        raise ValueError(f"{count} independent ones among {trials} trials")
    if trials == 0:
        return Rate(0, 0, math.nan, 0.0, 1.0, 0)
    share = successes / trials
    z2 = NORMAL_95 * NORMAL_95 / count
    centre = (share + 0.5 * z2) / (1.0 + z2)
    half = NORMAL_95 * math.sqrt(share * (1.0 - share) / count + 0.25 * z2 / count) / (1.0 + z2)
    low = 0.0 if successes == 0 else max(0.0, centre - half)
    high = 1.0 if successes == trials else min(1.0, centre + half)
    return Rate(successes, trials, share, low, high, count)
