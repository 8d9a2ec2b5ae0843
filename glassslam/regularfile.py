"""Only regular files are read: a pipe waits for a writer that may never come, a device never ends."""

import errno
from pathlib import Path
from stat import S_ISDIR, S_ISREG


def regular(path: str | Path) -> Path:
    """Make sure, before it is opened, that a path is no pipe, socket or device.

    Parameters
    ----------
    path : str or Path
        A path; that it is missing or a directory is left to be told by whoever opens it.

    Returns
    -------
    Path
        The same path.

    Raises
    ------
    OSError
        It is of such a kind; the reason is "it is no regular file".
    """
    place = Path(path)
    try:
        mode = place.stat().st_mode
    except OSError:
        return place
    if not (S_ISREG(mode) or S_ISDIR(mode)):
        raise OSError(errno.EINVAL, "it is no regular file", str(place))
    return place
