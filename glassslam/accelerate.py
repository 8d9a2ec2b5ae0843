"""The project's way of compiling kernels: no bounds checks, no GIL, cached on disk."""

import hashlib
import os
import stat
import tempfile
from collections.abc import Callable
from contextlib import suppress
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


def _own_folder() -> Path:
    """A folder for temporary files that nobody else can write: a cached kernel is code that will be run."""
    folder = Path(tempfile.gettempdir()) / f"glassslam-numba-{os.getuid()}"
    with suppress(OSError):
        folder.mkdir(mode=0o700, exist_ok=True)
        state = folder.lstat()
        if stat.S_ISDIR(state.st_mode) and state.st_uid == os.getuid() and not state.st_mode & 0o022:
            return folder
    return Path(tempfile.mkdtemp(prefix="glassslam-numba-"))


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
    base = user if _writable(user) else _own_folder()
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
