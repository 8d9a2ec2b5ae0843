"""`glassslam config`: print or compare configurations."""

from pathlib import Path
from typing import Annotated, Any

import typer

EXAMPLES = """\
  glassslam config > robot.yaml                 the defaults, to be edited
  glassslam config --set sensor.max_range=20    what a run would use
  glassslam config --diff default run-map       what a run had changed
"""

ConfigFile = Annotated[
    Path | None, typer.Option("--config", metavar="FILE", help="YAML file; the rest keeps the defaults.")
]
Assignments = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="SECTION.NAME=VALUE", help="Change one parameter; may be repeated."),
]
Pair = Annotated[
    tuple[str, str] | None,
    typer.Option("--diff", metavar="A B", help="Compare two: YAML files, results directories or 'default'."),
]


def config(config: ConfigFile = None, assignments: Assignments = None, diff: Pair = None) -> None:
    """Print the complete configuration as YAML, or the parameters in which two configurations differ."""
    from glassslam.cli.settings import resolve_config  # noqa: PLC0415  (loads pydantic)
    from glassslam.cli.terminal import emit  # noqa: PLC0415

    if diff is None:
        emit(resolve_config(config, assignments or ()).dump())
        return
    first, second = (_flatten(_load(name)) for name in diff)
    emit(
        "".join(f"{name}: {first[name]} -> {second[name]}\n" for name in first if first[name] != second[name])
    )


def _load(name: str) -> dict[str, Any]:
    from glassslam.config import Config  # noqa: PLC0415  (loads pydantic)

    path = Path(name)
    if name == "default":
        return Config().model_dump(mode="json")
    return Config.load(path / "config.yaml" if path.is_dir() else path).model_dump(mode="json")


def _flatten(data: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for name, value in data.items():
        flat.update(
            _flatten(value, f"{prefix}{name}.") if isinstance(value, dict) else {f"{prefix}{name}": value}
        )
    return flat
