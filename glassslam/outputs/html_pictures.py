"""Pictures of a results directory inside a web page."""

import base64
import math
from pathlib import Path
from typing import Any, Final

import numpy as np

from glassslam.errors import OutputError
from glassslam.outputs.html_page import escaped
from glassslam.outputs.picture import Image

PICTURES: Final = {
    "map.png": (
        "Black occupied, white free, grey unknown; the path in blue from its start (green) to its end (red); "
        "glass walls in blue-green."
    ),
    "labels.png": "What the cells are: black solid, blue glass, orange ghosts, white free, grey unknown.",
    "fused_map.png": "Lidar and sonar together.",
    "source_map.png": "Who decided the fused map: blue lidar, orange sonar, green both, grey neither.",
    "volume_map.png": "What lidar and 3D ultrasonic sensor have found in a band of heights, seen from above.",
    "volume.png": "The highest that is occupied in that band, in the colour of its height; white free.",
    "slices.png": "Horizontal slices of the volume: black occupied, white free, grey unknown.",
}
"""Pictures shown where they were written, and what is said of them."""

# One pixel a cell: enlarged, they shall keep their edges.
_OF_CELLS = ("labels.png", "source_map.png")
# All together, in base64 (4 bytes for 3), stay below 3 MB.
_MOST_BYTES = 2_000_000
# Browsers may have no memory for pictures of more pixels; what is scaled down at all becomes smaller.
_MOST_PIXELS, _SCALED_PIXELS = 25_000_000, 4_000_000


def picture_figures(folder: Path) -> str:
    """The pictures in a results directory as HTML figures, with the pictures themselves in them.

    Pictures too large for a page are scaled down; smaller ones stand in it byte by byte.

    Parameters
    ----------
    folder : Path
        Where the pictures are.

    Raises
    ------
    OutputError
        One of them is not a picture.
    OSError
        One of them cannot be read.
    """
    present = [name for name in PICTURES if (folder / name).is_file()]
    left, data = _MOST_BYTES, {}
    # Small ones leave what they do not need to the larger ones.
    for place, name in enumerate(sorted(present, key=lambda name: (folder / name).stat().st_size)):
        data[name] = _fitted(folder / name, left // (len(present) - place))
        left -= len(data[name])
    return "\n".join(_figure(name, data[name]) for name in present)


def _figure(name: str, data: bytes) -> str:
    style = ' class="cells"' if name in _OF_CELLS else ""
    source = f"data:image/png;base64,{base64.b64encode(data).decode('ascii')}"
    return (
        f'<figure>\n<img{style} alt="{escaped(name)}" src="{source}">\n'
        f"<figcaption><code>{escaped(name)}</code>: {escaped(PICTURES[name])}</figcaption>\n</figure>"
    )


def _fitted(path: Path, most_bytes: int) -> bytes:
    """The PNG file itself, or one scaled down by a whole factor."""
    data = path.read_bytes()
    pixels = _pixels(data, path)
    if len(data) <= most_bytes and pixels <= _MOST_PIXELS:
        return data
    import cv2  # noqa: PLC0415  (only pictures need it)

    decoded = cv2.imdecode(np.frombuffer(data, dtype=np.uint8), cv2.IMREAD_COLOR)
    if decoded is None:
        raise _no_picture(path)
    image: Image = np.asarray(decoded, dtype=np.uint8)
    factor = max(2, math.ceil(math.sqrt(pixels / _SCALED_PIXELS)))
    while True:
        image = _shrunk(cv2, image, factor)
        data = cv2.imencode(".png", image)[1].tobytes()
        if len(data) <= most_bytes:
            return data
        factor = 2


def _shrunk(cv2: Any, image: Image, factor: int) -> Image:
    """Means of squares, what is left over at the right and bottom cut off: far quicker than by a fraction."""
    height, width = (max(1, side // factor) for side in image.shape[:2])
    whole = image[: height * factor, : width * factor]
    return np.asarray(cv2.resize(whole, (width, height), interpolation=cv2.INTER_AREA))


def _pixels(data: bytes, path: Path) -> int:
    """Number of pixels by the header of a PNG file."""
    if data[1:4] != b"PNG" or len(data) < 24:
        raise _no_picture(path)
    return int.from_bytes(data[16:20], "big") * int.from_bytes(data[20:24], "big")


def _no_picture(path: Path) -> OutputError:
    return OutputError(f"{path} is no PNG picture")
