"""Scan matching: gradient refinement on the smooth grid, correlative searches before it."""

from glassslam.matching.branch_and_bound import BranchAndBoundMatcher, SearchMatch
from glassslam.matching.gradient import MatchResult, match_scan

__all__ = ["BranchAndBoundMatcher", "MatchResult", "SearchMatch", "match_scan"]
