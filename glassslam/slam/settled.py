"""A run whose poses stand: everything that maps are drawn from, without the machinery that found it."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from glassslam.config import Config
from glassslam.glass.layer import GlassLayer
from glassslam.grid.submap import Submap
from glassslam.posegraph.graph import Constraint
from glassslam.records import RecordingInfo
from glassslam.slam.node import Node
from glassslam.slam.result import MapResult, OccupancyMap, RunStatistics
from glassslam.slam.stopwatch import Stages
from glassslam.slam.trajectory import PoseTracks

if TYPE_CHECKING:  # runs that do not look for glass need not load what finds it
    from collections.abc import Callable
    from typing import TypeAlias

    from detectors.calibration import Calibration
    from glassslam.glass.beam_labels import GlassBeams
    from glassslam.glass.beams import BeamEvidence
    from glassslam.glass.observations import GlassObservations

    GlassSource: TypeAlias = Callable[[PoseTracks, BeamEvidence], GlassObservations]


@dataclass(frozen=True, slots=True)
class GlassFindings:
    """What the detector saw in the scans of a run.

    Attributes
    ----------
    observations : GlassObservations
        Pieces of glass, bound to the nodes.
    beams : GlassBeams or None
        Labels of single beams; None where no scan was looked at.
    calibration : Calibration or None
        What the run has learnt about its lidar by itself.
    """

    observations: "GlassObservations"
    beams: "GlassBeams | None" = None
    calibration: "Calibration | None" = None


@dataclass(frozen=True, slots=True)
class SettledRun:
    """Nodes, poses and findings of a run after its last optimisation.

    Attributes
    ----------
    config : Config
        The resolved configuration.
    nodes : tuple of Node
        All nodes.
    submaps : tuple of Submap
        All submaps; those of a run read back hold cells only where the scheme locks glass in them.
    constraints : tuple of Constraint
        Edges of the pose graph; vertex i is node i.
    tracks : PoseTracks
        Poses of scans and nodes.
    statistics : RunStatistics
        Counts; its times are those of `stages`.
    glass : GlassFindings or None
        What was seen of glass; None where the lidar was not asked.
    stages : Stages
        Times, to which drawing adds its own.
    """

    config: Config
    nodes: tuple[Node, ...]
    submaps: tuple[Submap, ...]
    constraints: tuple[Constraint, ...]
    tracks: PoseTracks
    statistics: RunStatistics
    glass: GlassFindings | None = None
    stages: Stages = field(default_factory=Stages)


def draw(
    run: SettledRun, info: RecordingInfo | None = None, glass_sources: "Sequence[GlassSource]" = ()
) -> MapResult:
    """Glass and maps of a run.

    Parameters
    ----------
    run : SettledRun
        The run; it may be drawn again with other sources or another configuration of map and glass.
    info : RecordingInfo, optional
        The source, for the report.
    glass_sources : sequence of callable
        Sensors beside the lidar that see glass: from the poses of the run and the beams of the lidar to
        observations bound to the nodes.
    """
    from glassslam.slam.render import render_run  # noqa: PLC0415  (loads kernels)

    with run.stages.measure("glass"):
        layer = glass_layer(run, glass_sources)
    with run.stages.measure("rendering"):
        rendering = render_run(run, layer, closed=len(glass_sources) > 0)
    times = dict(sorted(run.stages.times.items()))
    return MapResult(
        map=rendering.map,
        lidar_map=rendering.lidar,
        closed_map=rendering.closed,
        tracks=run.tracks,
        submap_nodes=tuple(submap.nodes[0] for submap in run.submaps),
        constraints=run.constraints,
        config=run.config,
        statistics=replace(run.statistics, stages=times),
        info=info,
        glass=rendering.glass,
        nodes=run.nodes,
    )


def returns_map(run: SettledRun) -> OccupancyMap:
    """Map of a run in which beams without echo clear nothing."""
    from glassslam.slam.render import render  # noqa: PLC0415  (loads kernels)

    nodes = [replace(node, free_ends=node.free_ends[:0]) for node in run.nodes]
    return render(nodes, run.tracks.nodes.poses, run.config.map)


def glass_layer(run: SettledRun, others: "Sequence[GlassSource]" = ()) -> GlassLayer | None:
    """Walls and observations at the optimised poses; None where no sensor looks for glass.

    Parameters
    ----------
    run : SettledRun
        The run.
    others : sequence of callable
        Sensors beside the lidar: from tracks and beams to observations bound to the nodes.
    """
    if run.glass is None and not others:
        return None
    from glassslam.glass.beams import BeamEvidence, Beams  # noqa: PLC0415
    from glassslam.glass.ghosts import find_ghosts  # noqa: PLC0415
    from glassslam.glass.observations import GlassObservations  # noqa: PLC0415
    from glassslam.glass.walls import fit_walls  # noqa: PLC0415

    seen = run.glass or GlassFindings(GlassObservations.empty())
    sensors, poses = [node.sensor for node in run.nodes], run.tracks.nodes.poses
    beams = BeamEvidence(
        Beams.pack(sensors, [node.ends for node in run.nodes]),
        Beams.pack(sensors, [node.free_ends for node in run.nodes]),
    )
    found = GlassObservations.joined([seen.observations, *(source(run.tracks, beams) for source in others)])
    positions, normals = found.at(poses)
    walls = tuple(fit_walls(found, poses, beams, run.config.glass.walls))
    ghosts = find_ghosts(walls, poses, beams, run.config.glass.walls.distance_tolerance)
    return GlassLayer(
        walls, found, positions, normals, beams=seen.beams, ghosts=ghosts, calibration=seen.calibration
    )
