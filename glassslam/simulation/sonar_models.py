"""Rings of sonars as the simulation knows them: where they sit, how far off they are, when they fire."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from glassslam.records import SonarRing
from glassslam.sources.rings import load_ring


@dataclass(frozen=True, slots=True)
class SonarModel:
    """Everything the simulation knows of a ring of sonars.

    The default errors are those of sonars that face glass, wood and sponge: below 5 %, and 11 cm at most
    (Wei et al., Fig. 5). A Pioneer fires one sonar of its front and one of its rear array every 40 ms.

    Attributes
    ----------
    ring : SonarRing
        Where the sonars sit, their cone and their limits.
    largest_error : float
        No reading is farther off than this, m.
    relative_error : float
        Nor farther off than this share of the range (and a step of 1 cm).
    firing_period : float
        Time between two groups, s.
    fired_together : int
        Sonars of one group: they fire at the same moment and may hear each other.
    no_echo : float
        What is written where nothing is heard, m: +inf, or the limit itself as some robots do.
    """

    ring: SonarRing
    largest_error: float = 0.11
    relative_error: float = 0.05
    firing_period: float = 0.04
    fired_together: int = 2
    no_echo: float = math.inf

    def groups(self) -> list[NDArray[np.int64]]:
        """Indices of the sonars that fire together, group after group; one sweep is all of them."""
        count = len(self.ring.poses)
        rounds = math.ceil(count / self.fired_together)
        return [np.arange(first, count, rounds) for first in range(rounds)]

    @property
    def sweep_period(self) -> float:
        """Time after which every sonar has fired once, s."""
        return len(self.groups()) * self.firing_period


def sonar_model(name: str | Path) -> SonarModel:
    """The ring of that name, or one described in a YAML file, with the usual errors and times.

    Raises
    ------
    UsageError
        There is no such ring.
    ConfigError
        The file cannot be read, or describes no ring.
    """
    return SonarModel(load_ring(name))
