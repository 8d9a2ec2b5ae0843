"""Session files: a run written down as it goes, to be taken up, drawn again and saved from damage."""

from glassslam.session.database import is_begun, is_session
from glassslam.session.session import SESSION_FILE, Session

__all__ = ["SESSION_FILE", "Session", "is_begun", "is_session"]
