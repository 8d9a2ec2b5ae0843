"""The shelf of data sets: where the shipped files are, and what is known of each public recording."""

import hashlib
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field

from glassslam.config import Config
from glassslam.errors import ConfigError, RecordingError
from glassslam.yamlmodel import load_yaml_model

Text = Annotated[str, Field(min_length=1)]


class Part(BaseModel):
    """One frozen piece of a card; unknown names are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class DataFile(Part):
    """One file of a data set."""

    path: Text
    """Place below the data folder (`$GLASSSLAM_DATA`)."""
    sha256: Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
    """Checksum of the copy the card was written for."""
    bytes: Annotated[int, Field(ge=1)]
    format: Literal["rosbag1", "rosbag2-sqlite3", "rosbag2-mcap", "carmen", "relations", "text", "json"]
    role: Literal["recording", "truth", "auxiliary"] = "recording"


class Sensor(Part):
    """The lidar of a recording as its scans show it."""

    model: Text
    beams: Text
    field_of_view_deg: Annotated[float, Field(gt=0, le=360)]
    rate_hz: Annotated[float, Field(gt=0)]
    range_max: Annotated[float, Field(gt=0)]
    """Farthest range the scanner is good for, m."""
    no_echo: Text
    """How a beam without echo is written."""
    intensities: Text


class Source(Part):
    """Where the original was published."""

    published: Text
    """The publication or project, in words."""
    address: str = ""
    """Address of the original; empty when it could not be established."""
    licence: Text = "not stated"


class DatasetCard(Part):
    """What there is to know before mapping a public recording."""

    name: Annotated[str, Field(pattern=r"^[a-z0-9-]+$")]
    title: Text
    what: Text
    """Place, robot, path, in a few sentences."""
    source: Source
    sensor: Sensor
    odometry: Text
    truth: Text
    """What the result can be measured against, and how far it can be trusted."""
    files: Annotated[tuple[DataFile, ...], Field(min_length=1)]
    options: tuple[str, ...] = ()
    """Options of `glassslam map` that suit it."""
    configuration: dict[str, Any] = {}
    """What its configuration changes from the defaults."""
    traps: tuple[Text, ...] = ()

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read a card.

        Raises
        ------
        ConfigError
            The file cannot be read, or holds an unknown, missing or unfit value; or its name is not
            that of the card; or its configuration is not one.
        """
        card = load_yaml_model(path, cls)
        if Path(path).stem != card.name:
            raise ConfigError(f"{path}: the card is named {card.name!r}")
        card.config()
        return card

    def config(self) -> Config:
        """The configuration that suits this data set.

        Raises
        ------
        ConfigError
            It holds an unknown or unfit value.
        """
        return Config.from_mapping(self.configuration, origin=f"card {self.name}")

    def check(self, data: str | Path) -> None:
        """Compare the files below a data folder with the card.

        Raises
        ------
        RecordingError
            A file is missing or is not the one the card was written for.
        """
        for file in self.files:
            path = Path(data) / file.path
            if not path.is_file():
                raise RecordingError(f"{path} is missing", f"published with: {self.source.published}")
            with path.open("rb") as stream:
                if hashlib.file_digest(stream, "sha256").hexdigest() != file.sha256:
                    raise RecordingError(f"{path} is not the file card {self.name!r} describes")


def datasets_folder() -> Path:
    """Folder of cards and scenes: inside an installed package, beside it in a checkout.

    Raises
    ------
    ConfigError
        The installation is incomplete.
    """
    package = Path(__file__).resolve().parent
    for folder in (package / "datasets", package.parent / "datasets"):
        if (folder / "scenes").is_dir():
            return folder
    raise ConfigError("the data sets that ship with glassslam are missing", "install the package again")


def cards() -> Iterator[DatasetCard]:
    """All shipped cards, by name.

    Raises
    ------
    ConfigError
        A card is unfit.
    """
    for path in sorted(datasets_folder().glob("*.yaml")):
        yield DatasetCard.load(path)
