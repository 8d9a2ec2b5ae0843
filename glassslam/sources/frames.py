"""Where the laser sits on the robot, and which transform is odometry: read off the tf topics."""

import itertools
from collections.abc import Collection, Sequence
from contextlib import closing

from glassslam.errors import UsageError
from glassslam.sources.bag import Bag, Topic
from glassslam.sources.topics import TF, Choice
from glassslam.sources.transforms import Edge, TransformTree, frame_name

BASE_FRAMES = ("base_footprint", "base_link", "base")

# Enough to see every publisher of a recording, little enough to be read twice.
_STATIC_MESSAGES = 10_000
_MOVING_MESSAGES = 3_000


def is_static(topic: Topic) -> bool:
    """Whether a tf topic carries fixed links only."""
    return topic.name.rstrip("/").endswith("tf_static")


def read_tree(bags: Sequence[Bag], topics: Collection[Topic], wanted: Sequence[str]) -> TransformTree:
    """The frames of a recording: all fixed links, and the moving ones of its beginning.

    Moving links are left out when the fixed ones already connect the `wanted` frames: they cost time. Without
    wanted frames everything may matter.
    """
    tree = TransformTree()
    fixed = [topic for topic in topics if is_static(topic)]
    moving = [topic for topic in topics if not is_static(topic)]
    for bag in bags:
        _collect(tree, bag, fixed, _STATIC_MESSAGES)
    if wanted and all(tree.lookup(wanted[0], frame) is not None for frame in wanted):
        return tree
    for bag in bags[:1]:
        _collect(tree, bag, moving, _MOVING_MESSAGES)
    return tree


def _collect(tree: TransformTree, bag: Bag, topics: Collection[Topic], limit: int) -> None:
    present = [topic for topic in bag.topics if any(_same(topic, wanted) for wanted in topics)]
    if not present:
        return
    decoders = {topic.msgtype: bag.decoder(topic.msgtype) for topic in present}
    with closing(bag.messages(present)) as messages:
        for topic, _, raw in itertools.islice(messages, limit):
            try:
                transforms = decoders[topic.msgtype](raw).transforms
            except Exception:  # noqa: S112  (one damaged message leaves the others readable)
                continue
            tree.add_message(transforms, topic.name, static=is_static(topic))


def _same(a: Topic, b: Topic) -> bool:
    return (a.name, a.msgtype) == (b.name, b.msgtype)


def odometry_edge(tree: TransformTree, choice: Choice) -> Edge | None:
    """The transform that is odometry, as far as wished for.

    Raises
    ------
    UsageError
        The named transform is missing, there is none to be found, or there are several.
    """
    if choice.odometry_from_tf is None:
        return None
    moving = [edge for edge in tree.edges.values() if not edge.static]
    wish = choice.odometry_from_tf.removeprefix(TF).removeprefix(":")
    if wish:
        parent, _, child = (frame_name(part.strip()) for part in wish.partition("->"))
        edge = tree.edges.get((parent, child))
        if edge is None:
            raise UsageError(f"no transform {wish} for odometry; candidates: {_list(moving)}")
        return edge
    candidates = [edge for edge in moving if "odom" in edge.parent.rsplit("/", 1)[-1]]
    if len(candidates) > 1:
        raise UsageError(
            f"several transforms may be odometry: {_list(candidates)}", "choose with --odom-topic"
        )
    if not candidates and choice.odometry_from_tf == TF:
        raise UsageError(f"no transform from an odometry frame; candidates: {_list(moving)}")
    return candidates[0] if candidates else None


def edge_name(edge: Edge) -> str:
    """How odometry from a transform is named, here and on the command line."""
    return f"{TF}:{edge.parent}->{edge.child}"


def _list(edges: Sequence[Edge]) -> str:
    return ", ".join(f"{edge_name(edge)} ({edge.topic}, tf)" for edge in edges) or "none"


def guess_base(tree: TransformTree, laser: str) -> str:
    """The base frame when no odometry names it: a customary name connected to the laser, else the laser."""
    return next((name for name in BASE_FRAMES if tree.lookup(name, laser) is not None), laser)
