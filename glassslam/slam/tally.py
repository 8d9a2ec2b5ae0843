"""What a run counts on its way, and the statistics it ends with."""

from collections import Counter
from dataclasses import dataclass, field

import numpy as np

from glassslam.posegraph.storage import LOOP
from glassslam.records import FloatArray, LaserScan
from glassslam.slam.closure_degeneracy import find_degeneracies
from glassslam.slam.degeneracy import Trace
from glassslam.slam.degeneracy_words import summarised
from glassslam.slam.extrapolator import PoseExtrapolator
from glassslam.slam.glass_choice import DetectorChoice
from glassslam.slam.global_slam import GlobalSlam
from glassslam.slam.local import LocalSlam
from glassslam.slam.motion_watch import MotionWatch
from glassslam.slam.rejoin import beginnings
from glassslam.slam.result import RunStatistics
from glassslam.slam.trajectory import PoseTracks

_FEW = 0.1


@dataclass(slots=True)
class Tally:
    """Scans counted one by one.

    Attributes
    ----------
    read : int
        Scans that came in.
    dropped : Counter
        Reason -> scans that could not be used.
    without_odometry : int
        Scans placed at a time that odometry did not reach.
    returns : int
        Returns in all scans placed, after thinning.
    stamps : list of float
        Of the scans placed, s.
    """

    read: int = 0
    dropped: Counter[str] = field(default_factory=Counter)
    without_odometry: int = 0
    returns: int = 0
    stamps: list[float] = field(default_factory=list)
    motion: MotionWatch = field(default_factory=MotionWatch)

    def place(
        self,
        scan: LaserScan,
        returns: int,
        odometry_pose: FloatArray | None,
        found_pose: FloatArray | None = None,
    ) -> None:
        """Count a scan that was given a pose, with that of the odometry at it, if it is known."""
        self.stamps.append(scan.stamp)
        self.returns += returns
        self.without_odometry += odometry_pose is None
        self.motion.add(scan, odometry_pose, found_pose)

    def excuse(self) -> str:
        """What came in, for a run that has nothing to show."""
        dropped = ", ".join(f"{count} x {reason}" for reason, count in sorted(self.dropped.items()))
        return f"{self.read} scans read; dropped: {dropped or 'none'}"


def run_statistics(
    tally: Tally,
    extrapolator: PoseExtrapolator,
    local: LocalSlam,
    world: GlobalSlam,
    glass: DetectorChoice,
    tracks: PoseTracks,
) -> RunStatistics:
    """Everything the report tells of a finished run."""
    found = find_degeneracies(_trace(tally, extrapolator, local, world, tracks))
    used, taken_out = world.closures()
    rejected = dict(sorted(world.rejected.items()))
    if taken_out:
        rejected["taken out after optimisation"] = taken_out
    not_finite = extrapolator.odometry.dropped
    return RunStatistics(
        scans_read=tally.read,
        scans_used=len(tally.stamps),
        scans_dropped=dict(sorted(tally.dropped.items())),
        messages_dropped={"odometry not finite": not_finite} if not_finite else {},
        recording_seconds=float(max(tally.stamps) - min(tally.stamps)),
        nodes=len(world.nodes),
        submaps=len(world.submaps),
        closures_tried=world.searches,
        closures_accepted=used,
        closures_rejected=rejected,
        residuals=world.residuals(),
        glass_detector=glass.name,
        glass_reason=glass.reason,
        solver_failures=world.solver_failures,
        tracking=_tracking(extrapolator, local, world),
        degeneracies=found,
        warnings=[
            *_warnings(tally, extrapolator, local),
            *summarised(found),
            *_failures(world.solver_failures),
            *glass.warnings,
        ],
    )


def _trace(
    tally: Tally, extrapolator: PoseExtrapolator, local: LocalSlam, world: GlobalSlam, tracks: PoseTracks
) -> Trace:
    edges = world.graph.edges
    is_loop = edges.kinds == LOOP
    return Trace(
        stamps=tracks.final.stamps,
        local=tracks.local.poses,
        final=tracks.final.poses,
        matches=local.log.arrays(),
        node_scans=np.array([node.scan for node in world.nodes], dtype=np.int64),
        begins=beginnings(world.nodes),
        searches=world.outcomes,
        used=edges.ends[is_loop & edges.enabled],
        taken_out=edges.ends[is_loop & ~edges.enabled],
        with_odometry=len(extrapolator.odometry) > 0,
        motion=tally.motion.report(),
    )


def _tracking(extrapolator: PoseExtrapolator, local: LocalSlam, world: GlobalSlam) -> dict[str, int]:
    now = local.tracking
    return {
        "searches": now.searches,
        "searches_taken": now.searches_taken,
        "relocalisations": now.relocalisations,
        "relocalised": now.relocalised,
        "coasted": now.coasted,
        "unmatched": now.unmatched,
        "odometry_jumps": extrapolator.jumps,
        "closures_ambiguous": world.ambiguous,
        "stretches": len(beginnings(world.nodes)) + 1,
    }


def _failures(count: int) -> list[str]:
    """That the map is not as good as it could be."""
    said = f"the pose graph could not be optimised {count} times: the poses of before were kept"
    return [said] if count else []


def _warnings(tally: Tally, extrapolator: PoseExtrapolator, local: LocalSlam) -> list[str]:
    used = len(tally.stamps)
    warnings = []
    if len(extrapolator.odometry) and tally.without_odometry > _FEW * used:
        warnings.append(
            f"odometry does not reach {tally.without_odometry} of {used} scans:"
            " its stamps may be of another clock"
        )
    if extrapolator.jumps:
        warnings.append(f"odometry jumped {extrapolator.jumps} times; those steps are not used")
    if unmatched := local.tracking.unmatched:
        warnings.append(
            f"{unmatched} of {used} scans had too few returns to match: their poses are predictions"
        )
    return warnings
