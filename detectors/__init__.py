"""Glass in single lidar scans: arrays in, observations and labels out, without any SLAM."""
