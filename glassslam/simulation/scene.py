"""A simulated world as written down: floor plan, materials, robot path and odometry."""

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from glassslam.cards import datasets_folder
from glassslam.errors import ConfigError
from glassslam.yamlmodel import load_yaml_model

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Point = tuple[Finite, Finite]


class Part(BaseModel):
    """One frozen piece of a scene; unknown names are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class Material(Part):
    """How a surface answers a laser beam."""

    kind: Literal["diffuse"] = "diffuse"
    """Law of reflection; a diffuse surface scatters evenly (Lambert)."""
    reflectance: Annotated[float, Field(gt=0, le=1)]
    """Share of the light that is scattered back, 1 = white paper."""


MATERIALS = {
    "plaster": Material(reflectance=0.85),
    "concrete": Material(reflectance=0.45),
    "brick": Material(reflectance=0.35),
    "wood": Material(reflectance=0.55),
    "painted_metal": Material(reflectance=0.6),
    "cardboard": Material(reflectance=0.65),
    "fabric": Material(reflectance=0.3),
    "black_plastic": Material(reflectance=0.08),
}
"""Materials every scene knows; a scene may add its own or redefine these."""


class Opening(Part):
    """A gap in a wall, for a door or a passage."""

    at: NonNegative
    """Distance of the nearer jamb from the first point, along the line, m."""
    width: Positive
    """Clear width, m."""


class Wall(Part):
    """A line of wall or of panes: open through `points`, closed when `closed`."""

    name: str
    material: str
    points: Annotated[tuple[Point, ...], Field(min_length=2)]
    closed: bool = False
    thickness: NonNegative = 0.0
    """Both faces are drawn this far apart, m; 0 draws the line itself."""
    openings: tuple[Opening, ...] = ()


class Box(Part):
    """Rectangular things standing on the floor."""

    name: str
    material: str
    size: tuple[Positive, Positive]
    """Extent along the x and y axis of the box, m."""
    at: Annotated[tuple[Point, ...], Field(min_length=1)]
    """Centre of each."""
    yaw_deg: Finite = 0.0


class Post(Part):
    """Round things standing on the floor: columns, legs, bins."""

    name: str
    material: str
    radius: Positive
    at: Annotated[tuple[Point, ...], Field(min_length=1)]
    """Centre of each."""


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


class OdometryModel(Part):
    """Wheel odometry: a scale error that stays, noise that adds up, slip in turns.

    The random terms are standard deviations after one unit of motion and grow with its square root.
    """

    rate: Positive = 50.0
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


class Scene(Part):
    """A world to simulate: everything but the lidar's own figures."""

    name: str
    description: str = ""
    sensor: str = "ust10lx"
    """Lidar carried unless another is asked for."""
    laser_pose: tuple[Finite, Finite, Finite] = (0.0, 0.0, 0.0)
    """Pose of the laser on the robot base: x m, y m, yaw rad."""
    start_time: NonNegative = 1_500_000_000.0
    """Stamp of the first moment, s since 1970."""
    materials: dict[str, Material] = {}
    walls: tuple[Wall, ...] = ()
    boxes: tuple[Box, ...] = ()
    posts: tuple[Post, ...] = ()
    drive: Drive
    odometry: OdometryModel = OdometryModel()

    @model_validator(mode="after")
    def _materials_known(self) -> Self:
        if not (self.walls or self.boxes or self.posts):
            raise ValueError("nothing to see: give walls, boxes or posts")
        things: list[Wall | Box | Post] = [*self.walls, *self.boxes, *self.posts]
        for thing in things:
            if thing.material not in self.palette():
                known = ", ".join(self.palette())
                raise ValueError(f"{thing.name!r} is made of unknown {thing.material!r} (known: {known})")
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
