"""Glass in single lidar scans: arrays in, observations and labels out, without any SLAM.

Examples
--------
>>> import detectors
>>> found = detectors.intensity_peak([2.0] * 3, [900, 5000, 900], thresh=3000, grad=500, width=10,
...     angle_min=0.0, angle_increment=0.01)
>>> found.beam.tolist()
[1]
"""

from detectors.calibrated_peak import calibrated_peak
from detectors.calibration import Calibration, PaneModel
from detectors.detection import Detection
from detectors.diffuse import DiffuseCurve
from detectors.informative import Verdict, is_intensity_informative
from detectors.intensity_peak import intensity_peak, wang_wang
from detectors.labels import base_labels
from detectors.narrow_return import narrow_return
from detectors.profiles import PROFILES, load_profile
from detectors.self_calibration import self_calibration, suggest_detector

__all__ = [
    "PROFILES",
    "Calibration",
    "Detection",
    "DiffuseCurve",
    "PaneModel",
    "Verdict",
    "base_labels",
    "calibrated_peak",
    "intensity_peak",
    "is_intensity_informative",
    "load_profile",
    "narrow_return",
    "self_calibration",
    "suggest_detector",
    "wang_wang",
]
