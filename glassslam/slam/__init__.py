"""SLAM: local tracking, loop closing, and the mapper that joins them."""
