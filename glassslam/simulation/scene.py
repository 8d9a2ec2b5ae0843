"""A simulated world as written down: floor plan, materials, robot path and odometry."""

import math
from pathlib import Path
from typing import Annotated, Self

from pydantic import Field, model_validator

from glassslam.cards import datasets_folder
from glassslam.errors import ConfigError
from glassslam.simulation.materials import MATERIALS, Finite, Material, NonNegative, Part, Positive, Rate
from glassslam.yamlmodel import load_yaml_model

Coordinate = Annotated[float, Field(ge=-1e4, le=1e4, allow_inf_nan=False)]
Extent = Annotated[float, Field(ge=1e-3, le=1e3, allow_inf_nan=False)]
Point = tuple[Coordinate, Coordinate]

# The true map of a larger plan would take gigabytes: 64 million cells.
LARGEST_PLAN = 160_000.0
LONGEST_DRIVE = 4 * 3600.0


class Opening(Part):
    """A gap in a wall, for a door or a passage."""

    at: NonNegative
    """Distance of the nearer jamb from the first point, along the line, m."""
    width: Positive
    """Clear width, m."""


class Panes(Part):
    """How a line of glass is divided: panes of equal width between mullions."""

    width: Annotated[Extent, Field(ge=0.05)] = 1.2
    """Widest pane, mullion included, m."""
    mullion: Positive = 0.06
    """Width of a mullion along the line, m."""
    depth: Positive = 0.1
    """Depth of a mullion across the line, m; its corners are cut."""
    material: str = "aluminium"


class Solid(Part):
    """Anything that stands or hangs between two heights."""

    z_low: NonNegative = 0.0
    """Height of its underside above the floor, m."""
    z_high: Positive = 2.5
    """Height of its top, m."""

    @model_validator(mode="after")
    def _has_height(self) -> Self:
        if self.z_low >= self.z_high:
            raise ValueError(f"z_low {self.z_low:g} is not below z_high {self.z_high:g}")
        return self


class Wall(Solid):
    """A line of wall or of panes: open through `points`, closed when `closed`."""

    name: str
    material: str
    points: Annotated[tuple[Point, ...], Field(min_length=2)]
    closed: bool = False
    thickness: NonNegative = 0.0
    """Both faces are drawn this far apart, m; 0 draws the line itself."""
    openings: tuple[Opening, ...] = ()
    panes: Panes | None = None
    """Given: the stretches between openings and corners are divided by mullions."""
    lean_deg: Finite = 0.0
    """Angle with the vertical, deg; panes that lean send their glint over or under the lidar."""

    @model_validator(mode="after")
    def _panes_are_thin(self) -> Self:
        if self.panes is not None and self.thickness > 0.0:
            raise ValueError(f"wall {self.name!r}: panes have no thickness")
        return self


class Box(Solid):
    """Rectangular things: on the floor, or table tops above it."""

    name: str
    material: str
    size: tuple[Extent, Extent]
    """Extent along the x and y axis of the box, m."""
    at: Annotated[tuple[Point, ...], Field(min_length=1)]
    """Centre of each."""
    yaw_deg: Finite = 0.0


class Post(Solid):
    """Round things: columns, legs, bins, hanging lamps."""

    name: str
    material: str
    radius: Extent
    at: Annotated[tuple[Point, ...], Field(min_length=1)]
    """Centre of each."""


class Person(Part):
    """Somebody who walks to and fro: two legs, seen as moving circles."""

    name: str
    points: Annotated[tuple[Point, ...], Field(min_length=2)]
    """The line walked, from one end to the other and back, for ever."""
    speed: Positive = 1.2
    """Walking speed, m/s."""
    start: Finite = 0.0
    """Place on the line at the first moment, m along the way there and back."""
    leg_radius: Positive = 0.06
    stance: Positive = 0.2
    """Distance between the legs across the line, m."""
    material: str = "fabric"


class Waypoint(Part):
    """A place the robot drives to."""

    at: Point
    speed: Positive = 0.6
    """Speed wanted on the way to this point, m/s."""
    stop: NonNegative | None = None
    """Seconds to stand here; without it the robot cuts past smoothly."""


class Drive(Part):
    """Where the robot goes and what its motors allow."""

    waypoints: Annotated[tuple[Waypoint, ...], Field(min_length=2)]
    acceleration: Positive = 0.5
    """Largest change of speed, m/s^2."""
    yaw_rate: Positive = 0.9
    """Fastest turn, rad/s."""
    yaw_acceleration: Positive = 1.8
    """Largest change of the yaw rate, rad/s^2."""
    look_ahead: Positive = 0.45
    """Distance of the carrot the robot steers for, m."""
    radius: Positive = 0.22
    """The robot must not come nearer to anything than this, m."""

    @model_validator(mode="after")
    def _ends(self) -> Self:
        steps = zip(self.waypoints, self.waypoints[1:], strict=False)
        seconds = sum(math.dist(a.at, b.at) / b.speed for a, b in steps)
        seconds += sum(waypoint.stop or 0.0 for waypoint in self.waypoints)
        if seconds > LONGEST_DRIVE:
            raise ValueError(
                f"the drive takes {seconds / 3600:.1f} h, at most are {LONGEST_DRIVE / 3600:g} h"
            )
        return self


class OdometryModel(Part):
    """Wheel odometry: a scale error that stays, noise that adds up, slip in turns.

    The random terms are standard deviations after one unit of motion and grow with its square root.
    """

    rate: Rate = 50.0
    """Messages per second."""
    distance_scale: Positive = 1.004
    """Measured over true distance (wheel diameter)."""
    turn_scale: Positive = 0.99
    """Measured over true rotation (wheel base and mean slip)."""
    distance_noise: NonNegative = 0.01
    """Distance error after 1 m, m."""
    turn_noise: NonNegative = 0.02
    """Heading error after 1 rad of turning, rad."""
    drift_noise: NonNegative = 0.006
    """Heading error after 1 m of driving, rad."""
    side_slip: NonNegative = 0.01
    """Sideways error after 1 rad of turning, m."""


class UltrasonicMount(Part):
    """A 3D ultrasonic sensor on the robot; without one a recording has no points."""

    pose: tuple[Finite, Finite, Finite] = (0.15, 0.0, 0.0)
    """Pose on the robot base: x m, y m, yaw rad; it hears around its x axis."""
    height: Positive = 0.4
    """Height above the floor, m."""
    rate: Rate = 20.0
    """Pings per second."""


class Scene(Part):
    """A world to simulate: everything but the lidar's own figures."""

    name: str
    description: str = ""
    sensor: str = "ust10lx"
    """Lidar carried unless another is asked for."""
    laser_pose: tuple[Finite, Finite, Finite] = (0.0, 0.0, 0.0)
    """Pose of the laser on the robot base: x m, y m, yaw rad."""
    laser_height: NonNegative = 0.2
    """Height of its plane above the floor, m: what does not reach it is not seen."""
    robot_height: Positive = 0.6
    """The robot passes below what begins higher than this, m."""
    ceiling: Positive | None = 2.5
    """Height of the ceiling, m; it is only heard."""
    ultrasonic: UltrasonicMount | None = None
    """A 3D ultrasonic sensor carried as well."""
    scan_rate: Rate | None = None
    """Scans recorded per second, at most those of the lidar; all when omitted."""
    start_time: Annotated[float, Field(ge=0, le=4e9, allow_inf_nan=False)] = 1_500_000_000.0
    """Stamp of the first moment, s since 1970."""
    materials: dict[str, Material] = Field(default_factory=dict)
    walls: tuple[Wall, ...] = ()
    boxes: tuple[Box, ...] = ()
    posts: tuple[Post, ...] = ()
    people: tuple[Person, ...] = ()
    drive: Drive
    odometry: OdometryModel = OdometryModel()

    @model_validator(mode="after")
    def _materials_known(self) -> Self:
        if not (self.walls or self.boxes or self.posts):
            raise ValueError("nothing to see: give walls, boxes or posts")
        things: list[Wall | Box | Post | Person] = [*self.walls, *self.boxes, *self.posts, *self.people]
        used = [(thing.name, thing.material) for thing in things]
        used += [(wall.name, wall.panes.material) for wall in self.walls if wall.panes is not None]
        for name, material in used:
            if material not in self.palette():
                known = ", ".join(self.palette())
                raise ValueError(f"{name!r} is made of unknown {material!r} (known: {known})")
        return self

    @model_validator(mode="after")
    def _fits_into_memory(self) -> Self:
        places = [point for wall in self.walls for point in wall.points]
        things: list[Box | Post] = [*self.boxes, *self.posts]
        places += [point for thing in things for point in thing.at]
        places += [waypoint.at for waypoint in self.drive.waypoints]
        width, depth = (max(p[axis] for p in places) - min(p[axis] for p in places) for axis in (0, 1))
        # the true map lies as the robot stands at first: turned by 45 deg a long plan takes most
        turned = 0.5 * (width + depth) ** 2
        if turned > LARGEST_PLAN:
            raise ValueError(
                f"the plan covers {width:.0f} x {depth:.0f} m, up to {turned:.0f} m2 of map when turned:"
                f" at most are {LARGEST_PLAN:.0f} m2"
            )
        return self

    def palette(self) -> dict[str, Material]:
        """All materials by name: the common ones, overlaid by those of the scene."""
        return MATERIALS | self.materials

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read a scene file.

        Raises
        ------
        ConfigError
            The file cannot be read, or holds an unknown, missing or unfit value.
        """
        return load_yaml_model(path, cls)


def find_scene(name: str | Path) -> Path:
    """Path of a scene given by path, or by the name of one that is shipped.

    Raises
    ------
    ConfigError
        There is neither such a file nor such a scene.
    """
    shipped = datasets_folder() / "scenes"
    for candidate in (Path(name), shipped / f"{name}.yaml"):
        if candidate.is_file():
            return candidate
    names = ", ".join(sorted(path.stem for path in shipped.glob("*.yaml")))
    raise ConfigError(f"no scene {str(name)!r}", f"give the path of a scene file or one of: {names}")
