"""A few of the cases of tools/fuzz.py, the same ones every time; the tool itself runs thousands."""

import os
import subprocess
import sys
from pathlib import Path

TOOL = Path(__file__).resolve().parent.parent / "tools" / "fuzz.py"
CASES = 84
KINDS = {
    "bag", "folder", "messages", "carmen", "player", "pimap", "ring", "config", "calibration", "truth",
    "unmerged", "scene", "volume", "session",
}  # fmt: skip


def fuzz(*words):
    environment = {name: value for name, value in os.environ.items() if name != "GLASSSLAM_DEBUG"}
    return subprocess.run(
        [sys.executable, TOOL, "--simulated", *words],
        check=False, capture_output=True, text=True, timeout=600, env=environment,
    )  # fmt: skip


def test_damaged_inputs_end_in_a_result_or_one_clear_line(tmp_path):
    done = fuzz("--cases", str(CASES), "--seed", "7", "--keep", str(tmp_path))
    assert done.returncode == 0, done.stdout
    kinds = [line.split() for line in done.stdout.splitlines() if "exit" not in line]
    total = next(words for words in kinds if words[0] == "all")
    assert int(total[1]) == CASES
    assert sum(map(int, total[2:6])) == CASES
    assert min(int(words[1]) for words in kinds if words[0] in KINDS) == CASES // len(KINDS)
    assert list(tmp_path.iterdir()) == []


def test_a_violation_is_found_and_can_be_had_again(tmp_path):
    """A tool that cannot fail finds nothing: a program that speaks of unexpected errors is one."""
    script = (
        "import sys; sys.argv = ['fuzz.py', *sys.argv[2:]]; sys.path.insert(0, 'tools');"
        "from glassslam import yamltext\n"
        "def broken(text): raise ZeroDivisionError('oops')\n"
        "import glassslam.config as config; config.parse_yaml = broken\n"
        "import fuzz; sys.exit(fuzz.main())"
    )
    words = ["--simulated", "--kind", "config", "--only", "3", "--seed", "7", "--keep", str(tmp_path)]
    done = subprocess.run(
        [sys.executable, "-c", script, "fuzz", *words],
        check=False, capture_output=True, text=True, timeout=600, cwd=TOOL.parent.parent,
    )  # fmt: skip
    assert done.returncode == 1
    assert "error: unexpected ZeroDivisionError: oops" in done.stdout
    assert "again: python tools/fuzz.py --kind config --seed 7 --only 3" in done.stdout
    assert (tmp_path / "config-7-3" / "COMMAND").read_text().startswith("glassslam ")
    assert (tmp_path / "config-7-3" / "robot.yaml").exists()
