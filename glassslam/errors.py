"""Every error a user can meet: one line of cause, one line of hint."""


class GlassSlamError(Exception):
    """Base of all errors raised on purpose.

    Parameters
    ----------
    message : str
        The cause, one line.
    hint : str
        What to do about it, one line; may be empty.
    """

    exit_code = 1

    def __init__(self, message: str, hint: str = "") -> None:
        super().__init__(message)
        self.message = message
        self.hint = hint


class UsageError(GlassSlamError):
    """A wrong or missing option, or an ambiguous request."""

    exit_code = 2


class ConfigError(UsageError):
    """An unknown, ill-typed or non-finite configuration value."""


class RecordingError(GlassSlamError):
    """A recording that cannot be read at all."""


class UnreachableRecordingError(RecordingError):
    """A recording whose disk or connection fails while it is read; it may come back."""


class NoScansError(RecordingError):
    """A recording in which no usable laser scan was found."""


class CalibrationError(GlassSlamError):
    """Recordings from which a lidar cannot be calibrated."""


class OutputError(GlassSlamError):
    """A result that cannot be written or read back."""


class SessionError(GlassSlamError):
    """A session file that cannot be used."""


class InterruptedRunError(GlassSlamError):
    """A run that was asked to end before it was through; it can be taken up again.

    Parameters
    ----------
    message, hint : str
        As for every error.
    exit_code : int
        130 or 143, as the shell tells of SIGINT and SIGTERM.
    """

    def __init__(self, message: str, hint: str, exit_code: int = 130) -> None:
        super().__init__(message, hint)
        self.exit_code = exit_code


class EvaluationError(GlassSlamError):
    """A truth file that does not fit the result."""


class GridError(GlassSlamError):
    """A probability grid, or a scan entered into one or matched against it, that makes no sense."""


class MapSizeError(GridError):
    """A map that would be larger than any building."""


class GraphError(GlassSlamError):
    """A pose graph that cannot be built or solved."""
