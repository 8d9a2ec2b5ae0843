"""`glassslam map`: make a map from a recording."""

from pathlib import Path
from typing import Annotated

import typer

from glassslam.cli.run import Manner, begin
from glassslam.cli.run import resume as go_on
from glassslam.errors import UsageError

EXAMPLES = """\
  glassslam map run.bag                             results in run-map/
  glassslam map run.bag -o office --overwrite       replace earlier results
  glassslam map run.bag --sensor ust10lx            find glass walls as well
  glassslam map run.bag --calibration mine/         the same with a lidar calibrated before
  glassslam map run.bag --require-intensity         fail where intensities cannot show glass
  glassslam map run.bag --sonar sonar.txt           take sonar from a second file
  glassslam map part1.bag part2.bag -o office       recordings that follow each other
  glassslam map run.mcap --scan-topic /front/scan   choose among several lidars
  glassslam map run.bag --laser-pose 0.1,0,0        the laser sits 0.1 m ahead of the centre
  glassslam map run.clf.gz --config sick.yaml --set sensor.max_range=20
  glassslam map --resume office                     go on with a run that was interrupted
  glassslam map run.bag --start 10 --duration 60 --every 2
"""

Recordings = Annotated[
    list[Path] | None,
    typer.Argument(
        metavar="RECORDING...",
        help="ROS 1 or 2 bag (file or directory), mcap, CARMEN or Player log; several follow each other.",
        show_default=False,
    ),
]
Output = Annotated[
    Path | None,
    typer.Option("--output", "-o", metavar="DIR", help="Results directory [default: NAME-map]."),
]
ConfigFile = Annotated[
    Path | None,
    typer.Option("--config", metavar="FILE", help="YAML file of parameters; see glassslam config."),
]
Assignments = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="SECTION.NAME=VALUE", help="Change one parameter; may be repeated."),
]
Sensor = Annotated[
    str | None,
    typer.Option(
        metavar="NAME",
        help="Look for glass with a lidar of this kind: utm30lx, ust10lx, tim781, lms511 or rplidar.",
    ),
]
CalibrationFile = Annotated[
    Path | None,
    typer.Option(
        "--calibration",
        metavar="FILE",
        help="Look for glass with the calibration of this lidar; see calibrate.",
    ),
]
RequireIntensity = Annotated[
    bool,
    typer.Option(
        "--require-intensity",
        help="Fail where the intensities of the recording tell nothing, rather than map without glass.",
    ),
]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace earlier results in DIR.")]
ScanTopic = Annotated[str | None, typer.Option(help="Topic of the laser scans.", metavar="TOPIC")]
OdomTopic = Annotated[str | None, typer.Option(help="Topic of the odometry; tf, or none.", metavar="TOPIC")]
ImuTopic = Annotated[str | None, typer.Option(help="Topic of the IMU, or none.", metavar="TOPIC")]
Sonar = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="File with sonar readings: bag, Player log or pi-map text log."),
]
SonarTopic = Annotated[
    list[str] | None,
    typer.Option(metavar="TOPIC", help="Topic of the sonars, or none; may be repeated."),
]
PointsTopic = Annotated[
    list[str] | None,
    typer.Option(metavar="TOPIC", help="Topic of 3D ultrasonic points, or none; may be repeated."),
]
SonarRing = Annotated[
    str | None,
    typer.Option(
        metavar="NAME|FILE",
        help="Where the sonars sit: pioneer-3dx, pioneer-2dx, turtlebot-9 or a YAML file.",
    ),
]
LaserPose = Annotated[
    str | None, typer.Option(metavar="X,Y,YAW", help="Pose of the laser on the robot, m and rad.")
]
Start = Annotated[float, typer.Option(metavar="SECONDS", help="Leave out the first seconds.")]
Duration = Annotated[
    float | None, typer.Option(metavar="SECONDS", help="Use so many seconds [default: all].")
]
Every = Annotated[int, typer.Option(metavar="N", help="Use every N-th scan.")]
Echo = Annotated[
    str, typer.Option(metavar="WHICH", help="Echo of multi-echo scans: first, last or strongest.")
]
Strict = Annotated[bool, typer.Option("--strict", help="Refuse a damaged bag, rather than read the rest.")]
Resume = Annotated[
    Path | None,
    typer.Option(
        metavar="DIR",
        help="Go on with the interrupted run into DIR, as it was begun. RECORDING only if it has moved.",
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Print the report as JSON instead of the summary.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")]


def map_command(
    recordings: Recordings = None,
    output: Output = None,
    config: ConfigFile = None,
    assignments: Assignments = None,
    sensor: Sensor = None,
    calibration: CalibrationFile = None,
    require_intensity: RequireIntensity = False,
    overwrite: Overwrite = False,
    scan_topic: ScanTopic = None,
    odom_topic: OdomTopic = None,
    imu_topic: ImuTopic = None,
    sonar: Sonar = None,
    sonar_topic: SonarTopic = None,
    points_topic: PointsTopic = None,
    sonar_ring: SonarRing = None,
    laser_pose: LaserPose = None,
    start: Start = 0.0,
    duration: Duration = None,
    every: Every = 1,
    echo: Echo = "first",
    strict: Strict = False,
    resume: Resume = None,
    json: Json = False,
    quiet: Quiet = False,
) -> int:
    """Make a map from a recording and write it, the trajectory, the pose graph and a report to DIR.

    Topics are picked where there is only one choice. DIR appears when everything is done; until then
    earlier results stay as they were, and the run is in DIR.partial, from where --resume goes on with it.
    The first Ctrl-C ends a run with a map of what there is, the second one at once.
    """
    from glassslam.outputs import Stopwatch, check_directory  # noqa: PLC0415  (loads numpy)

    manner = Manner(Stopwatch(), json=json, quiet=quiet)
    if resume is not None:
        refuse_others(
            output, config, assignments, sensor, calibration, require_intensity, scan_topic, odom_topic,
            imu_topic, sonar, sonar_topic, points_topic, sonar_ring, laser_pose, start, duration,
            strict, every != 1, echo != "first",
        )  # fmt: skip
        return go_on(resume, recordings, manner, overwrite=overwrite)
    if not recordings:
        raise UsageError("no recording is named", "glassslam map RECORDING, or --resume DIR")
    from glassslam.cli.settings import (  # noqa: PLC0415
        calibration_assignments,
        check_elsewhere,
        check_intensity_use,
        default_directory,
        intensity_assignments,
        parse_pose,
        resolve_config,
        sensor_assignments,
    )

    directory = output or default_directory(recordings)
    check_elsewhere(directory)
    check_directory(directory, overwrite=overwrite)
    pose, resolved = (
        parse_pose(laser_pose),
        resolve_config(
            config,
            [
                *sensor_assignments(sensor),
                *calibration_assignments(calibration, sensor, config),
                *intensity_assignments(required=require_intensity),
                *(assignments or ()),
            ],
        ),
    )
    check_intensity_use(resolved)
    from glassslam.sources import SourceOptions  # noqa: PLC0415  (loads rosbags)

    options = SourceOptions(
        scan_topic=scan_topic,
        odom_topic=odom_topic,
        imu_topic=imu_topic,
        laser_pose=pose,
        start=start,
        duration=duration,
        every=every,
        echo=echo,  # type: ignore[arg-type]  # other words are refused by SourceOptions
        sonar=sonar,
        sonar_topic=tuple(sonar_topic) if sonar_topic else None,
        sonar_ring=sonar_ring,
        points_topic=tuple(points_topic) if points_topic else None,
        strict=strict,
    )
    return begin(recordings, directory, resolved, options, overwrite=overwrite, manner=manner)


def refuse_others(*given: object) -> None:
    """Make sure that a run that goes on is not asked for anything else.

    Raises
    ------
    UsageError
        One of the options is given.
    """
    if any(value not in (None, False, 0.0) for value in given):
        raise UsageError(
            "--resume goes on with a run as it was begun: no other options",
            "draw its results in another way afterwards: glassslam render",
        )
