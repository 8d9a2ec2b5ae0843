"""Write the numba kernels of every symbolic model into the `_generated.py` beside it.

Run it after changing a model; with `--check` it writes nothing and exits 1 when a file is out of date.
"""

import importlib
import sys
from pathlib import Path

from glassslam.symbolic import render_module

ROOT = Path(__file__).resolve().parent.parent
MODELS = {
    "glassslam.posegraph.model": "Residuals of the pose graph and their derivatives",
    "glassslam.matching.model": "Residuals of scan matching and their derivatives",
}
"""Module with a `functions()` that returns name -> casadi.Function, and the title of its kernels."""


def available() -> dict[str, str]:
    """Models whose file exists."""
    return {module: title for module, title in MODELS.items() if _path(module).with_name("model.py").exists()}


def generated_path(module: str) -> Path:
    """File that holds the kernels of a model."""
    return _path(module).with_name("_generated.py")


def _path(module: str) -> Path:
    return ROOT.joinpath(*module.split(".")).with_suffix(".py")


def source(module: str) -> str:
    """What the file of a model should hold."""
    return render_module(importlib.import_module(module).functions(), MODELS[module])


def main(arguments: list[str]) -> int:
    """Write or check every file; the exit code."""
    stale = 0
    for module in available():
        path, text = generated_path(module), source(module)
        if path.exists() and path.read_text(encoding="utf-8") == text:
            continue
        if "--check" in arguments:
            print(f"{path.relative_to(ROOT)} is out of date: run tools/generate_kernels.py")
            stale = 1
        else:
            path.write_text(text, encoding="utf-8")
            print(f"wrote {path.relative_to(ROOT)}")
    return stale


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
