"""Lidar and sonar joined: opinion pools, decision layers, revisited rays, and a filter of scans."""
