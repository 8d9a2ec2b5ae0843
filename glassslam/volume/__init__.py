"""3D maps from a 2D lidar and a 3D ultrasonic sensor: octree, fusion, projection, files."""
