"""The map of a session alone, without its recording: what its nodes and loop closures give."""

from collections.abc import Sequence

import numpy as np

from glassslam.errors import SessionError
from glassslam.finished import FinishedRun, SourceFacts
from glassslam.records import FloatArray, RecordingInfo, Trajectory
from glassslam.session.session import Session
from glassslam.slam.closure import Closure
from glassslam.slam.global_slam import GlobalSlam
from glassslam.slam.journal import NoJournal
from glassslam.slam.node import Node
from glassslam.slam.result import RunStatistics
from glassslam.slam.settled import SettledRun
from glassslam.slam.stopwatch import Stages
from glassslam.slam.trajectory import PoseTracks, corrected_poses


class _KnownRounds(NoJournal):
    """Rounds of an earlier run, and nothing beyond them."""

    def __init__(self, rounds: Sequence[list[Closure]]) -> None:
        self._rounds = iter(rounds)

    def recall_round(self) -> list[Closure]:
        """What the next round of searches found; nothing past the end of what is known."""
        return next(self._rounds, [])


def rebuilt(session: Session) -> FinishedRun:
    """The run of a session as far as it goes; glass and sonar, which take the recording, are left out.

    Parameters
    ----------
    session : Session
        A session that is not finished.

    Raises
    ------
    SessionError
        It does not hold a single node.
    """
    nodes, (stamps, poses) = session.nodes(), session.scans()
    if not nodes:
        raise SessionError(f"{session.path} holds no node yet", "go on with glassslam map --resume")
    stages = Stages()
    world = GlobalSlam(session.config, stages, _KnownRounds(session.rounds()))
    for node in nodes:
        world.add_node(node)
    world.finish()
    used, taken_out = world.closures()
    settled = SettledRun(
        config=session.config,
        nodes=nodes,
        submaps=(),
        constraints=world.graph.constraints,
        tracks=_tracks(world, nodes, stamps, poses),
        statistics=RunStatistics(
            scans_read=len(stamps),
            scans_used=len(stamps),
            recording_seconds=float(np.ptp(stamps)),
            nodes=len(nodes),
            closures_tried=world.searches,
            closures_accepted=used,
            closures_rejected={"taken out after optimisation": taken_out} if taken_out else {},
            residuals=world.residuals(),
            glass_reason="the recording was not read",
            warnings=["made of the session alone: the rest of the recording, glass and sonar are not in it"],
        ),
        stages=stages,
    )
    names = tuple(recorded.given for recorded in session.recordings)
    info = RecordingInfo(names, "session", float(np.ptp(stamps)), len(stamps))
    return FinishedRun(settled, SourceFacts(info, {}), is_whole=False)


def _tracks(world: GlobalSlam, nodes: Sequence[Node], stamps: FloatArray, poses: FloatArray) -> PoseTracks:
    """Poses of all scans; those corrected on the way are not known any more and are the final ones."""
    numbers = np.array([node.scan for node in nodes])
    in_local = np.array([node.pose_in_local for node in nodes])
    final = Trajectory(stamps, corrected_poses(poses, numbers, in_local, world.poses))
    return PoseTracks(
        local=Trajectory(stamps, poses),
        partial=final,
        nodes=Trajectory(np.array([node.stamp for node in nodes]), np.array(world.poses)),
        final=final,
    )
