"""What must be known of a Player log before its records can be streamed."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from glassslam.errors import NoScansError, UsageError
from glassslam.records import Damage, SonarRing
from glassslam.sources.bag import Topic
from glassslam.sources.formats import Piece
from glassslam.sources.noecho import NoEcho, detect_no_echo
from glassslam.sources.options import UNUSED, SourceOptions
from glassslam.sources.playerdevices import PlayerDevices, player_lines
from glassslam.sources.playervalues import Pose
from glassslam.sources.ringgeometry import USUAL_FIELD_OF_VIEW
from glassslam.sources.rings import load_ring
from glassslam.sources.sweeps import Series, SweepRule, no_echo_of, sweep_rule
from glassslam.sources.textlines import TextLog, text_damage
from glassslam.sources.topics import describe, pick_topic

RING_HINT = "--sonar-ring NAME or FILE says where the sonars sit"


@dataclass(frozen=True, slots=True)
class PlayerSonar:
    """The ring of sonars in use: its device, where its sonars sit, and how their ranges are read."""

    device: str = ""
    ring: SonarRing | None = None
    rule: SweepRule | None = None


@dataclass(frozen=True, slots=True)
class PlayerSurvey:
    """Everything decided before streaming.

    Attributes
    ----------
    devices : PlayerDevices
        What the log holds.
    laser, odometry : str
        Devices in use; `odometry` equals `laser` when the pose written with the scans is used, "" for none.
    base_from_laser : tuple of float
        (x, y, yaw), m and rad.
    no_echo : NoEcho
        What a silent beam looks like.
    sonar : PlayerSonar
        The ring.
    warnings : tuple of str
        What a user should know.
    damage : tuple of Damage
        What could not be read.
    """

    devices: PlayerDevices
    laser: str
    odometry: str
    base_from_laser: Pose
    no_echo: NoEcho
    sonar: PlayerSonar
    warnings: tuple[str, ...]
    damage: tuple[Damage, ...] = ()


def gather_devices(
    pieces: Sequence[Piece], *, strict: bool = False
) -> tuple[PlayerDevices, tuple[Damage, ...]]:
    """Read logs that are pieces of one recording once, quickly; and what of them cannot be read.

    Raises
    ------
    RecordingError
        A file cannot be read; or is damaged, and `strict` was said.
    """
    devices = PlayerDevices()
    logs = [TextLog(piece, strict=strict) for piece in pieces]
    for log in logs:
        for line in player_lines(log):
            if line is not None and not isinstance(line, str):
                devices.add(line)
    return devices, text_damage(logs, devices.counts.total(), devices.first, devices.last)


def survey_player(pieces: Sequence[Piece], options: SourceOptions) -> PlayerSurvey:
    """Read a log once and decide how its lines are used.

    Raises
    ------
    NoScansError, UsageError, RecordingError
        As in `open_recording`.
    """
    devices, damage = gather_devices(pieces, strict=options.strict)
    seconds = max(0.0, devices.last - devices.first)
    lasers = _topics(devices, devices.scans)
    laser = pick_topic("scan", lasers, ["Player laser", "Player ranger"], options.scan_topic, seconds)
    if laser is None:
        raise NoScansError(f"no usable laser line in {pieces[0].path}", _recorded(devices, seconds))
    sonar, warning = _sonar_or_warning(devices, options, seconds)
    return PlayerSurvey(
        devices=devices,
        laser=laser.name,
        odometry=_odometry(devices, laser.name, options.odom_topic, seconds),
        base_from_laser=options.laser_pose or devices.geometry.get(laser.name, (0.0, 0.0, 0.0)),
        no_echo=detect_no_echo(scan.ranges for scan in devices.scans[laser.name]),
        sonar=sonar,
        warnings=(warning,) if warning else (),
        damage=damage,
    )


def _recorded(devices: PlayerDevices, seconds: float) -> str:
    return f"recorded: {describe(_topics(devices, devices.counts), seconds) or 'nothing'}"


def _topics(devices: PlayerDevices, names: Iterable[str]) -> list[Topic]:
    return [Topic(name, f"Player {name.partition(':')[0]}", devices.counts[name]) for name in names]


def _odometry(devices: PlayerDevices, laser: str, wish: str | None, seconds: float) -> str:
    if wish == UNUSED:
        return ""
    if wish == laser and devices.poses_with_scans:
        return laser
    positions = [name for name in devices.counts if name.startswith("position")]
    chosen = pick_topic(
        "odom", _topics(devices, positions), ["Player position", "Player position2d"], wish, seconds
    )
    if chosen is not None:
        return chosen.name
    if wish is not None:
        raise UsageError(f"odom topic {wish} is not in the log; candidates: none")
    return laser if devices.poses_with_scans else ""


def _sonar_or_warning(
    devices: PlayerDevices, options: SourceOptions, seconds: float
) -> tuple[PlayerSonar, str]:
    """The ring; without a wish of the user, one that cannot be used costs a warning."""
    try:
        return choose_sonar(devices, options, seconds), ""
    except UsageError as error:
        if options.sonar_topics or options.points_topics or options.sonar_ring is not None:
            raise
        hint = f" ({error.hint})" if error.hint else ""
        return PlayerSonar(), f"sonar is not used: {error.message}{hint}"


def choose_sonar(devices: PlayerDevices, options: SourceOptions, seconds: float) -> PlayerSonar:
    """Decide which device is the ring, and how its ranges are read.

    Raises
    ------
    UsageError
        There are several, none where one is wished for, or the ring has another number of sonars.
    """
    if options.points_topics:
        raise UsageError("a Player log holds no 3D points", "leave out --points-topic")
    if options.without_sonar:
        return PlayerSonar()
    topics = _topics(devices, devices.sweeps)
    wishes = options.sonar_topics
    if len(wishes) > 1:
        raise UsageError("a Player log is read with one ring of sonars", "name one --sonar-topic")
    wish = wishes[0] if wishes else None
    topic = pick_topic("sonar", topics, ["Player sonar", "Player ranger"], wish, seconds)
    if topic is None:
        if wish is not None or options.sonar_ring is not None:
            raise UsageError("there is no sonar in the log", _recorded(devices, seconds))
        return PlayerSonar()
    return _ring_of(devices, topic.name, options)


def _ring_of(devices: PlayerDevices, name: str, options: SourceOptions) -> PlayerSonar:
    sizes = [len(ranges) for _, ranges in devices.sweeps[name]]
    usual = max(set(sizes), key=sizes.count)
    kept = [(time, ranges) for time, ranges in devices.sweeps[name] if len(ranges) == usual]
    series: Series = np.array([time for time, _ in kept]), np.array([ranges for _, ranges in kept])
    if options.sonar_ring is not None:
        ring = load_ring(options.sonar_ring)
    elif name in devices.rings:
        # Without a silent sonar the farthest echo is below the limit.
        silent = no_echo_of([series]).value
        far = np.nextafter(np.nanmax(series[1]), np.float32(np.inf)) if silent is None else silent
        ring = SonarRing(devices.rings[name], USUAL_FIELD_OF_VIEW, 0.0, float(far))
    else:
        raise UsageError(f"the log does not tell where the sonars of {name} sit", RING_HINT)
    if len(ring.poses) != usual:
        named = f"the ring {ring.name}" if ring.name else "the geometry in the log"
        raise UsageError(
            f"{named} has {len(ring.poses)} sonars, {name} sends {usual} ranges",
            "choose another ring with --sonar-ring",
        )
    return PlayerSonar(name, ring, sweep_rule(ring, [series]))
