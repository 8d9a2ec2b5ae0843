"""How the detectors compile their kernels: nopython, without the GIL, cached on disk where one can write."""

import hashlib
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba

_F = TypeVar("_F", bound=Callable[..., Any])


def _writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


def _fingerprint() -> str:
    """Digest of the sources: numba would not notice that a kernel it has put into its callers changed."""
    sources = sorted(Path(__file__).parent.glob("*.py"))
    return hashlib.sha256(b"".join(path.read_bytes() for path in sources)).hexdigest()[:12]


def _cache_folder() -> str:
    """Folder of compiled kernels: what the user set, else the user's cache, else a temporary one."""
    chosen = os.environ.get("NUMBA_CACHE_DIR", "")
    if chosen and _writable(Path(chosen)):
        return str(Path(chosen) / f"detectors-{_fingerprint()}")
    user = Path(os.environ.get("XDG_CACHE_HOME") or Path("~").expanduser() / ".cache")
    base = user / "glassslam" / "numba"
    fallback = Path(tempfile.gettempdir()) / f"glassslam-numba-{os.getuid()}"
    return str((base if _writable(base) else fallback) / f"detectors-{_fingerprint()}")


_config: Any = numba.config
_FOLDER = _cache_folder()


def kernel(function: _F) -> _F:
    """Compile `function` in nopython mode with numpy error semantics, without the GIL, cached."""
    # numba reads the folder when a function is decorated; restored, so that no other package is affected
    before = _config.CACHE_DIR
    _config.CACHE_DIR = _FOLDER
    try:
        return cast(_F, numba.njit(cache=True, nogil=True, error_model="numpy")(function))
    finally:
        _config.CACHE_DIR = before
