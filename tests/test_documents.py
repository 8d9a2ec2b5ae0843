"""The documents tell the truth: examples run, links lead somewhere, options and names exist."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from glassslam.cards import datasets_folder
from glassslam.cli.app import COMMANDS, load_command
from glassslam.simulation import LIDARS, Scene, simulate
from glassslam.simulation.scene import MATERIALS

ROOT = Path(__file__).resolve().parent.parent
DOCUMENTS = sorted([ROOT / "README.md", ROOT / "CHANGELOG.md", *(ROOT / "docs").glob("*.md")])


def blocks(name, language):
    return re.findall(rf"^```{language}\n(.*?)^```", (ROOT / name).read_text(encoding="utf-8"), re.M | re.S)


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.name)
def test_links_lead_to_files(path):
    for target in re.findall(r"\]\(([^)#]+)\)", path.read_text(encoding="utf-8")):
        assert target.startswith("https://") or (path.parent / target).exists(), target


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.name)
def test_no_path_of_a_particular_machine(path):
    assert not re.search(r"/(work|home|root|tmp)/", path.read_text(encoding="utf-8"))


def test_the_examples_of_the_interface_run(tmp_path):
    program = "\n".join(blocks("docs/api.md", "python"))
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", program],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
    )
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "run-map" / "map.yaml").is_file()


def test_the_scene_of_the_documents_can_be_simulated():
    (text,) = blocks("docs/datasets.md", "yaml")
    simulation = simulate(Scene.model_validate(yaml.safe_load(text)))
    assert simulation.driven > 3.0


def test_the_documents_name_every_lidar_material_and_card():
    text = (ROOT / "docs" / "datasets.md").read_text(encoding="utf-8")
    for name in (*LIDARS, *MATERIALS, *(path.stem for path in datasets_folder().glob("*.yaml"))):
        assert name in text, name


def options(command):
    return {option for parameter in load_command(command).params for option in parameter.opts}


def test_the_commands_of_the_readme_exist():
    lines = [line for block in blocks("README.md", "console") for line in block.splitlines()]
    commands = [line.split("#")[0].split() for line in lines if line.startswith("glassslam ")]
    assert len(commands) >= 4
    for _, command, *words in commands:
        assert {word for word in words if word.startswith("-")} <= options(command), command


def test_the_options_named_in_the_documents_exist():
    known = set().union(*(options(command) for command in COMMANDS))
    for path in DOCUMENTS:
        for code in re.findall(r"`([^`\n]+)`", path.read_text(encoding="utf-8")):
            assert set(re.findall(r"(?<![\w-])--[a-z][a-z-]*", code)) <= known, code
