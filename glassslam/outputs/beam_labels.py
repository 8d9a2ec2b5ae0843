"""glass_beams.npz: what the glass detector said about single beams."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from detectors.labels import GHOST, GLASS
from glassslam.errors import GlassSlamError, OutputError
from glassslam.glass.beam_labels import GlassBeams
from glassslam.regularfile import regular

_COLUMNS = {"stamps": np.float64, "scan": np.int64, "beam": np.int32, "count": np.int32, "label": np.uint8}
MOST_BYTES = 2 << 30
"""More than the labels of any recording: an archive may claim to hold anything."""


def write_beam_labels(beams: GlassBeams, path: Path) -> Path:
    """Write the runs of labelled beams and the stamps of all scans looked at, compressed.

    The arrays are those of `GlassBeams`; see docs/formats.md.
    """
    with path.open("wb") as file:
        np.savez_compressed(file, **{name: getattr(beams, name) for name in _COLUMNS})
    return path


def read_beam_labels(path: str | Path) -> GlassBeams:
    """Read what `write_beam_labels` has written.

    Raises
    ------
    OutputError
        The file cannot be read, is no npz, or does not hold runs of labelled beams.
    """
    arrays = read_arrays(path, tuple(_COLUMNS), "it is written by map when a glass detector is on")
    if not _fits(arrays):
        raise OutputError(f"{path} does not hold the labels of beams", "expected glass_beams.npz of map")
    return GlassBeams(**{name: arrays[name].astype(kind) for name, kind in _COLUMNS.items()})


def read_arrays(
    path: str | Path,
    names: tuple[str, ...],
    hint: str,
    optional: tuple[str, ...] = (),
    kind: type[GlassSlamError] = OutputError,
) -> dict[str, NDArray[np.generic]]:
    """Named arrays of an npz file; never an object that would have to be unpickled.

    Parameters
    ----------
    path : str or Path
        The file.
    names, optional : tuple of str
        Arrays it must hold, and arrays it may hold.
    hint : str
        Where such a file comes from.
    kind : type of GlassSlamError
        What to raise.

    Raises
    ------
    GlassSlamError
        Of that kind: the file cannot be read, is no npz, would fill the memory, or lacks an array.
    """
    try:
        with regular(path).open("rb") as file:
            content = np.load(file, allow_pickle=False)
            known = content.files if isinstance(content, np.lib.npyio.NpzFile) else None
            size = sum(member.file_size for member in content.zip.infolist()) if known else 0
            if size > MOST_BYTES:
                raise kind(f"{path} would unpack to {size / 1e9:.1f} GB", hint)  # noqa: TRY301  (its like is passed on below)
            arrays = {name: content[name] for name in (*names, *optional) if known and name in known}
    except GlassSlamError:
        raise
    except OSError as error:
        raise kind(f"cannot read {path}: {error.strerror or 'damaged'}", hint) from error
    except Exception as error:
        # the readers of zip files and arrays raise what they like; a header may claim any size
        raise kind(f"{path} is no npz file", hint) from error
    if known is None:
        raise kind(f"{path} is no npz file", hint)
    if missing := [name for name in names if name not in arrays]:
        raise kind(f"{path} has no array {missing[0]!r}", hint)
    return arrays


def _fits(arrays: dict[str, NDArray[np.generic]]) -> bool:
    """Whether the arrays are runs of beams of the scans."""
    if any(array.ndim != 1 or array.dtype.kind not in "iuf" for array in arrays.values()):
        return False
    scan, beam, count, label = (arrays[name] for name in ("scan", "beam", "count", "label"))
    if not len(scan) == len(beam) == len(count) == len(label):
        return False
    if any(array.dtype.kind == "f" for array in (scan, beam, count, label)):
        return False
    stamps = arrays["stamps"]
    inside = (scan >= 0) & (scan < len(stamps)) & (beam >= 0) & (count > 0)  # type: ignore[operator]
    return bool(
        inside.all() and np.isin(label, (GLASS, GHOST)).all() and np.isfinite(stamps.astype(np.float64)).all()
    )
