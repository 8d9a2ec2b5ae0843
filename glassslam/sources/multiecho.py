"""Fast reading of sensor_msgs/MultiEchoLaserScan: an object per beam would cost milliseconds a scan."""

import struct
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glassslam.records import Float32Array
from glassslam.sources.options import Echo

_SCALARS = struct.Struct("<7f")
_U32 = struct.Struct("<I")
_STAMP = struct.Struct("<II")


@dataclass(frozen=True, slots=True)
class EchoScan:
    """A multi-echo scan with one echo chosen for each beam.

    Attributes
    ----------
    stamp_ns : int
        Time of the header, ns.
    frame_id : str
        Name of the laser frame.
    angle_min, angle_max, angle_increment : float
        Angles of the beams, rad.
    time_increment, scan_time : float
        Time between beams and between scans, s.
    range_min, range_max : float
        Limits written in the header, m.
    ranges : ndarray of float32, shape (n,)
        The chosen echo, m; +inf where a beam has none.
    intensities : ndarray of float32, shape (n,) or (0,)
        Strength of the chosen echo.
    """

    stamp_ns: int
    frame_id: str
    angle_min: float
    angle_max: float
    angle_increment: float
    time_increment: float
    scan_time: float
    range_min: float
    range_max: float
    ranges: Float32Array
    intensities: Float32Array


def parse_ros1(raw: bytes, echo: Echo) -> EchoScan:
    """A scan from the ROS1 serialisation.

    Raises
    ------
    ValueError
        The message is cut off or inconsistent.
    """
    return _parse(raw, 4, echo, aligned=False)


def parse_cdr(raw: bytes, echo: Echo) -> EchoScan:
    """A scan from the little-endian CDR serialisation of ROS2.

    Raises
    ------
    ValueError
        The message is cut off, inconsistent, or big-endian.
    """
    if len(raw) < 4 or not raw[1] & 1:
        raise ValueError("only little-endian CDR is read here")
    return _parse(raw[4:], 0, echo, aligned=True)


def _parse(data: bytes, offset: int, echo: Echo, *, aligned: bool) -> EchoScan:
    try:
        seconds, nanoseconds = _STAMP.unpack_from(data, offset)
        (length,) = _U32.unpack_from(data, offset + 8)
        text_end = offset + 12 + length
        frame_id = data[offset + 12 : text_end].rstrip(b"\x00").decode()
        # CDR starts every number at a multiple of its size; ROS1 packs without gaps.
        scalars = text_end + (-text_end % 4 if aligned else 0)
        header = _SCALARS.unpack_from(data, scalars)
    except (struct.error, UnicodeDecodeError) as error:
        raise ValueError("the message is cut off") from error
    rest = data[scalars + _SCALARS.size :]
    ranges, intensities = _choose(np.frombuffer(rest[: len(rest) // 4 * 4], dtype="<u4"), echo)
    angle_min, angle_max, increment, time_increment, scan_time, range_min, range_max = header
    return EchoScan(
        stamp_ns=seconds * 10**9 + nanoseconds,
        frame_id=frame_id,
        angle_min=angle_min,
        angle_max=angle_max,
        angle_increment=increment,
        time_increment=time_increment,
        scan_time=scan_time,
        range_min=range_min,
        range_max=range_max,
        ranges=ranges,
        intensities=intensities,
    )


def _choose(words: NDArray[np.uint32], echo: Echo) -> tuple[Float32Array, Float32Array]:
    from glassslam.sources.echo_kernels import (  # noqa: PLC0415  (numba is loaded for such scans only)
        FIRST,
        LAST,
        STRONGEST,
        count_beams,
        pick_echoes,
    )

    mode = {"first": FIRST, "last": LAST, "strongest": STRONGEST}[echo]
    beams, with_intensity = count_beams(words)
    if beams < 0:
        raise ValueError("the echoes are cut off")
    ranges = np.empty(beams, dtype=np.float32)
    intensities = np.empty(with_intensity, dtype=np.float32)
    pick_echoes(words, words.view(np.float32), mode, ranges, intensities)
    return ranges, intensities
