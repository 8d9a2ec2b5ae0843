"""Files made of a finished run, and their readers."""

from glassslam.outputs.directory import RESULT_FILES, check_directory, staged_directory
from glassslam.outputs.g2o import G2oGraph, read_g2o, write_g2o
from glassslam.outputs.map_server import read_map, trinary_image, write_map
from glassslam.outputs.picture import write_picture
from glassslam.outputs.report import Stopwatch, Usage, build_report
from glassslam.outputs.results import write_results
from glassslam.outputs.trajectory import read_tum, write_tum

__all__ = [
    "RESULT_FILES",
    "G2oGraph",
    "Stopwatch",
    "Usage",
    "build_report",
    "check_directory",
    "read_g2o",
    "read_map",
    "read_tum",
    "staged_directory",
    "trinary_image",
    "write_g2o",
    "write_map",
    "write_picture",
    "write_results",
    "write_tum",
]
