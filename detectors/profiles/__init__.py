"""Calibrations of sensors of which recordings were at hand, each with its evidence."""

from importlib.resources import files

from detectors.calibration import Calibration

PROFILES = ("utm30lx", "ust10lx", "tim781", "lms511", "rplidar")


def load_profile(name: str) -> Calibration:
    """Load the calibration of a sensor.

    Parameters
    ----------
    name : str
        One of `PROFILES`.

    Raises
    ------
    ValueError
        There is no such profile.

    Examples
    --------
    >>> load_profile("utm30lx").beams
    1081
    """
    if name not in PROFILES:
        raise ValueError(f"no profile of a sensor {name!r}; there are {', '.join(PROFILES)}")
    import yaml  # noqa: PLC0415  (the detectors themselves need numpy and numba only)

    text = files(__name__).joinpath(f"{name}.yaml").read_text(encoding="utf-8")
    return Calibration.from_dict(yaml.safe_load(text))
