"""Sonar rings: poses of their sweeps, maps from their cones, glass that only they see."""
