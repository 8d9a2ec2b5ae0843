"""Recordings made by simulation, with the truth: scenes, lidars, motion, odometry, ray casting."""

from glassslam.simulation.recording import WrittenRecording, write_recording
from glassslam.simulation.rosbag1 import write_rosbag1
from glassslam.simulation.scene import Scene, find_scene
from glassslam.simulation.sensors import LIDARS, LidarModel, lidar
from glassslam.simulation.simulate import Simulation, simulate
from glassslam.simulation.truth import TruthPaths, truth_paths, write_truth
from glassslam.simulation.truth_log import TruthLog

__all__ = [
    "LIDARS",
    "LidarModel",
    "Scene",
    "Simulation",
    "TruthLog",
    "TruthPaths",
    "WrittenRecording",
    "find_scene",
    "lidar",
    "simulate",
    "truth_paths",
    "write_recording",
    "write_rosbag1",
    "write_truth",
]
