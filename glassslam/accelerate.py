"""The project's way of compiling kernels: no bounds checks, no GIL, cached on disk."""

import hashlib
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

_F = TypeVar("_F", bound=Callable[..., Any])


def _writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


def _fingerprint() -> str:
    """Digest of all kernels: numba would not notice that one its cached callers inlined has changed."""
    package = Path(__file__).parent
    sources = [
        *package.glob("*/*kernels.py"),
        *package.glob("*/_generated.py"),
        package / "posegraph" / "storage.py",
    ]
    return hashlib.sha256(b"".join(path.read_bytes() for path in sorted(sources))).hexdigest()[:12]


def _choose_cache_folder() -> None:
    """Point numba at a folder it can write: it raises at import time otherwise."""
    if "NUMBA_CACHE_DIR" in os.environ and _writable(Path(os.environ["NUMBA_CACHE_DIR"])):
        return
    user = Path(os.environ.get("XDG_CACHE_HOME") or Path("~").expanduser() / ".cache") / "glassslam" / "numba"
    base = user if _writable(user) else Path(tempfile.gettempdir()) / f"glassslam-numba-{os.getuid()}"
    folder = base / _fingerprint()
    os.environ["NUMBA_CACHE_DIR"] = str(folder)


_choose_cache_folder()

import numba  # noqa: E402  (the cache folder must be known before numba reads its configuration)

# somebody may have imported numba before: it reads its environment only once
_config: Any = numba.config
_config.CACHE_DIR = os.environ["NUMBA_CACHE_DIR"]


def kernel(function: _F) -> _F:
    """Compile `function` in nopython mode with numpy error semantics, without the GIL, cached."""
    return cast(_F, numba.njit(cache=True, nogil=True, error_model="numpy")(function))
