"""Recordings made by simulation, with the truth: scenes, lidars, motion, odometry, ray casting."""

from glassslam.simulation.drive import Motion
from glassslam.simulation.recording import WrittenRecording, write_recording
from glassslam.simulation.rosbag1 import write_rosbag1
from glassslam.simulation.scene import Scene, find_scene
from glassslam.simulation.sensors import LIDARS, LidarModel, lidar
from glassslam.simulation.simulate import Simulation, simulate, simulate_along
from glassslam.simulation.sonar_models import SonarModel, sonar_model
from glassslam.simulation.truth import TruthPaths, true_map, truth_paths, write_true_map, write_truth
from glassslam.simulation.truth_log import TruthLog
from glassslam.simulation.truth_map import TrueMap, draw_true_map, in_sight

__all__ = [
    "LIDARS",
    "LidarModel",
    "Motion",
    "Scene",
    "Simulation",
    "SonarModel",
    "TrueMap",
    "TruthLog",
    "TruthPaths",
    "WrittenRecording",
    "draw_true_map",
    "find_scene",
    "in_sight",
    "lidar",
    "simulate",
    "simulate_along",
    "sonar_model",
    "true_map",
    "truth_paths",
    "write_recording",
    "write_rosbag1",
    "write_true_map",
    "write_truth",
]
