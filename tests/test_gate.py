"""What a newcomer relies on: the commands of the README work, the wheel is whole, the gate is the gate."""

import os
import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest

from glassslam.cards import datasets_folder

ROOT = Path(__file__).resolve().parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


def test_every_package_is_shipped():
    folders = {
        ".".join(path.parent.relative_to(ROOT).parts)
        for top in ("glassslam", "detectors")
        for path in (ROOT / top).rglob("__init__.py")
    }
    assert set(PROJECT["tool"]["setuptools"]["packages"]) == folders | {"glassslam.datasets"}


def test_scenes_and_cards_are_found_in_the_checkout():
    assert datasets_folder() == ROOT / "datasets"
    assert (datasets_folder() / "scenes" / "office.yaml").is_file()


def test_an_installed_package_finds_its_own_scenes(monkeypatch, tmp_path):
    installed = tmp_path / "site" / "glassslam"
    (installed / "datasets" / "scenes").mkdir(parents=True)
    monkeypatch.setattr("glassslam.cards.__file__", str(installed / "cards.py"))
    assert datasets_folder() == installed / "datasets"


def test_the_gate_is_executable_and_calls_make_test():
    gate = ROOT / ".ci" / "run"
    assert os.access(gate, os.X_OK)
    assert "make test" in gate.read_text(encoding="utf-8")
    assert subprocess.run(["bash", "-n", gate], check=False).returncode == 0


def make(*words):
    if shutil.which("make") is None:
        pytest.skip("make is not installed")
    return subprocess.run(["make", "-C", ROOT, *words], capture_output=True, text=True, check=False)


def test_make_test_runs_every_check():
    planned = make("--dry-run", "test").stdout
    for check in ("ruff check .", "ruff format --check .", "mypy --strict", "/pytest"):
        assert check in planned


def test_an_old_python_is_refused_in_one_line(tmp_path):
    old = tmp_path / "python"
    old.write_text("#!/bin/sh\nexit 1\n", encoding="utf-8")
    old.chmod(0o755)
    done = make(f"PYTHON={old}", f"VENV={tmp_path / 'venv'}", "install")
    assert done.returncode != 0
    assert f"glassslam needs Python 3.11 or newer; '{old}' is not" in done.stdout
    assert not (tmp_path / "venv").exists()
