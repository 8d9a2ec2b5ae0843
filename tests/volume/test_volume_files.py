"""Files of a volume: npz, OctoMap, PLY and pictures, written and read back."""

import hashlib

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from volume_worlds import drawn_tree, listed

from glassslam.errors import OutputError, UsageError
from glassslam.volume import pictures
from glassslam.volume.colours import height_colours
from glassslam.volume.files import VOLUME_FILES, check_folder, write_volume
from glassslam.volume.octomap_file import most_likely, write_octomap
from glassslam.volume.octomap_kernels import write_nodes
from glassslam.volume.octree import CENTRE, Leaves, Octree, encode
from glassslam.volume.odds import Clamp
from glassslam.volume.pictures import slice_bands, write_slices, write_top_view
from glassslam.volume.ply import write_ply
from glassslam.volume.storage import load_volume, save_volume

key = st.integers(CENTRE - 3, CENTRE + 4)
trees = st.lists(
    st.tuples(st.tuples(key, key, key), st.sampled_from([-0.4, 0.85, -9.0, 9.0])), min_size=1, max_size=60
)


def grown(pairs, resolution=0.05):
    tree = Octree(resolution)
    tree.add(encode(np.array([k for k, _ in pairs])), np.array([v for _, v in pairs], dtype=np.float32))
    return tree


@pytest.fixture
def lamp():
    """Two voxels of a lamp over a free floor of 4 x 3."""
    return drawn_tree(["....\n....\n....", "????\n?##?\n????"], 0.1)


@given(trees)
def test_a_saved_volume_comes_back(tmp_path_factory, pairs):
    tree, path = grown(pairs), tmp_path_factory.mktemp("npz") / "volume.npz"
    again = load_volume(save_volume(tree, path))
    assert listed(again.leaves()) == listed(tree.leaves())
    assert (again.resolution, again.clamp) == (0.05, tree.clamp)


def test_the_arrays_are_those_of_the_layout(lamp, tmp_path):
    with np.load(save_volume(lamp, tmp_path / "volume.npz"), allow_pickle=False) as file:
        kinds = {name: (file[name].dtype.kind, file[name].ndim) for name in file}
        assert (str(file["format"]), int(file["version"])) == ("glassslam-volume", 1)
        assert file["clamp"].tolist() == [0.1192, 0.971, 0.5]
    assert kinds == {
        "format": ("U", 0), "version": ("i", 0), "resolution": ("f", 0), "clamp": ("f", 1),
        "codes": ("i", 1), "depths": ("u", 1), "log_odds": ("f", 1),
    }  # fmt: skip


def test_the_same_volume_makes_the_same_bytes(lamp, tmp_path):
    digests = set()
    for name in ("one", "two"):
        paths = write_volume(lamp, tmp_path / name)
        digests.add(tuple(hashlib.sha256(path.read_bytes()).hexdigest() for path in paths))
    assert len(digests) == 1


def changed(path, **arrays):
    with np.load(path) as file:
        np.savez(path, **{**{name: file[name] for name in file}, **arrays})
    return path


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"version": 2}, "is of version 2, known is 1"),
        ({"format": "other"}, "is no volume"),
        ({"codes": np.array([5, 4])}, "is damaged"),
        ({"clamp": np.array([0.7, 0.9, 0.8])}, "is damaged: a voxel cannot be clamped"),
        ({"resolution": -1.0}, "is damaged: resolution of a volume is -1.0 m"),
    ],
)
def test_a_foreign_or_damaged_volume_is_refused(lamp, tmp_path, change, words):
    path = changed(save_volume(lamp, tmp_path / "volume.npz"), **change)
    with pytest.raises(OutputError, match=words):
        load_volume(path)


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 no zip", b"text", np.array([1]).tobytes()])
def test_what_is_no_npz_is_refused(tmp_path, content):
    path = tmp_path / "volume.npz"
    path.write_bytes(content)
    with pytest.raises(OutputError, match=r"cannot read .*volume.npz: not an npz file"):
        load_volume(path)


def test_a_cut_off_volume_is_refused(lamp, tmp_path):
    path = save_volume(lamp, tmp_path / "volume.npz")
    path.write_bytes(path.read_bytes()[:200])
    with pytest.raises(OutputError, match="cannot read"):
        load_volume(path)


def test_a_missing_volume_is_refused(tmp_path):
    with pytest.raises(OutputError, match=r"cannot read .*none.npz: No such file or directory"):
        load_volume(tmp_path / "none.npz")


def naive_binary(leaves, threshold):
    """OctoMap's bytes, parents first, from a recursion over cubes."""

    def write(place, depth):
        bits, inner = 0, []
        for child in range(8):
            corner = place | child << 3 * (15 - depth)
            size = 8 ** (15 - depth)
            inside = [(c, d, v) for c, d, v in leaves if corner <= c < corner + size]
            if not inside:
                continue
            if inside[0][1] == depth + 1:
                bits |= (2 if inside[0][2] >= threshold else 1) << 2 * child
            else:
                bits |= 3 << 2 * child
                inner.append(corner)
        return bits.to_bytes(2, "little") + b"".join(write(corner, depth + 1) for corner in inner)

    return write(0, 0)


def payload(path):
    """What follows the header."""
    return path.read_bytes().partition(b"\ndata\n")[2]


@given(trees)
def test_an_octomap_file_holds_what_is_likely(tmp_path_factory, pairs):
    tree, path = grown(pairs), tmp_path_factory.mktemp("bt") / "volume.bt"
    likely = most_likely(tree)
    voxels, decided = tree.leaves().voxels(), likely.leaves().voxels()
    assert decided.codes.tolist() == voxels.codes.tolist()
    assert ((decided.log_odds > 0) == (voxels.log_odds >= 0)).all()
    assert payload(write_octomap(tree, path)) == naive_binary(listed(likely.leaves()), 0.0)


def test_the_header_is_that_of_octomap(lamp, tmp_path):
    lines = write_octomap(lamp, tmp_path / "volume.bt").read_bytes().split(b"\n")
    nodes, _ = most_likely(lamp).count()
    assert lines[0] == b"# Octomap OcTree binary file"
    assert lines[2:6] == [b"id OcTree", b"size %d" % nodes, b"res 0.1", b"data"]


def test_one_voxel_is_written_as_octomap_itself_writes_it(tmp_path):
    tree = grown([((CENTRE, CENTRE, CENTRE), 9.0)], 0.1)
    # a voxel at the origin: a path of 15 inner nodes, the first in the last octant, then the first child
    chain = (3 << 14).to_bytes(2, "little") + (3).to_bytes(2, "little") * 14 + (2).to_bytes(2, "little")
    path = write_octomap(tree, tmp_path / "volume.bt")
    assert b"\nsize 17\n" in path.read_bytes()
    assert payload(path) == chain


def test_an_empty_volume_is_an_octomap_file_without_nodes(tmp_path):
    content = write_octomap(Octree(0.2), tmp_path / "empty.bt").read_bytes()
    assert content.endswith(b"\nid OcTree\nsize 0\nres 0.2\ndata\n")


def test_a_volume_of_one_leaf_has_no_octomap_file(tmp_path):
    whole = Leaves(np.zeros(1, np.int64), np.zeros(1, np.uint8), np.ones(1, np.float32))
    with pytest.raises(OutputError, match="a volume of one leaf that spans everything has no OctoMap file"):
        write_octomap(Octree.from_leaves(whole, 0.1), tmp_path / "volume.bt")


@given(trees)
def test_the_binary_kernel_is_its_naive_twin(pairs):
    tree = grown(pairs)
    expected = naive_binary(listed(tree.leaves()), 0.0)
    out = np.empty(len(expected), np.uint8)
    assert write_nodes(tree._first_child, tree._log_odds, 0.0, out) == len(expected)
    assert out.tobytes() == expected == tree.binary()


def test_a_ply_file_holds_every_occupied_voxel(tmp_path):
    tree = drawn_tree(["##\n##", "##\n##", ".?\n??", "#?\n??"], 0.1)
    head, _, body = write_ply(tree, tmp_path / "volume.ply").read_bytes().partition(b"end_header\n")
    assert head.decode().splitlines() == [
        "ply", "format binary_little_endian 1.0", "comment centres of occupied voxels, m",
        "element vertex 9", "property float x", "property float y", "property float z",
        "property uchar red", "property uchar green", "property uchar blue", "property float probability",
    ]  # fmt: skip
    kind = np.dtype([("at", "<f4", 3), ("rgb", "u1", 3), ("p", "<f4")])
    rows = np.frombuffer(body, dtype=kind)
    assert rows["at"][-1].tolist() == pytest.approx([0.05, 0.15, 0.35])
    assert rows["rgb"][0].tolist() == [70, 20, 120]
    assert rows["rgb"][-1].tolist() == [210, 40, 40]
    assert rows["p"] == pytest.approx(np.full(9, 0.971), abs=1e-4)


def test_a_ply_file_of_nothing_has_no_points(tmp_path):
    assert b"element vertex 0\n" in write_ply(Octree(), tmp_path / "volume.ply").read_bytes()


def test_colours_rise_from_violet_to_red_and_end_there():
    low, middle, high, above = height_colours(np.array([0.0, 1.0, 2.0, 9.0]), 0.0, 2.0).tolist()
    assert (low, middle, high, above) == ([70, 20, 120], [20, 170, 110], [210, 40, 40], [210, 40, 40])


def test_the_top_view_shows_the_lamp_over_the_floor(lamp, tmp_path):
    picture = cv2.imread(str(write_top_view(lamp, tmp_path / "volume.png")))
    zoom = 8
    cells = picture[zoom // 2 : 3 * zoom : zoom, zoom // 2 : 4 * zoom : zoom, ::-1].tolist()
    white, colour = [255, 255, 255], [70, 20, 120]
    assert cells == [[white] * 4, [white, colour, colour, white], [white] * 4]


def test_a_band_takes_the_lamp_out_of_the_top_view(lamp, tmp_path):
    picture = cv2.imread(str(write_top_view(lamp, tmp_path / "volume.png", (0.0, 0.1))))
    assert (picture[:24, :32] == 255).all()


def test_slices_are_cut_where_something_is_occupied(lamp):
    assert slice_bands(lamp) == [(pytest.approx(0.1), pytest.approx(0.2))]
    assert slice_bands(lamp, (0.0, 0.1)) == []


def test_many_layers_are_gathered_in_at_most_twelve_slices():
    tree = drawn_tree(["#"] * 40 + ["?"] * 20 + ["#"], 0.1)
    bands = slice_bands(tree)
    assert len(bands) <= 12
    assert len({round(high - low, 6) for low, high in bands}) == 1
    z = tree.centres(tree.occupied().voxels())[:, 2]
    assert all(sum(low <= height <= high for low, high in bands) == 1 for height in z)


def test_the_slice_of_the_lamp_shows_it_black_and_the_unknown_grey(lamp, tmp_path):
    picture = cv2.imread(str(write_slices(lamp, tmp_path / "slices.png")), cv2.IMREAD_GRAYSCALE)
    cells = picture[22 + 4 : 22 + 24 : 8, 5 + 4 : 5 + 32 : 8].tolist()
    assert cells == [[225] * 4, [225, 0, 0, 225], [225] * 4]


def test_where_nothing_is_occupied_one_slice_shows_what_is_free(tmp_path):
    bare = drawn_tree(["....\n.??.\n...."], 0.1)
    for band in (None, (0.0, 0.1)):
        picture = cv2.imread(str(write_slices(bare, tmp_path / "slices.png", band)), cv2.IMREAD_GRAYSCALE)
        panel = picture[22:-5, 5 : 5 + 4 * 8]
        assert (panel == 255).mean() == pytest.approx(10 / 12)
        assert (panel == 225).mean() == pytest.approx(2 / 12)


def test_a_large_slice_is_drawn_smaller_and_loses_nothing_that_is_occupied(lamp, tmp_path, monkeypatch):
    monkeypatch.setattr(pictures, "_LARGEST_SLICE", 3)
    monkeypatch.setattr(pictures, "_READABLE_SLICE", 1)
    picture = cv2.imread(str(write_slices(lamp, tmp_path / "slices.png")), cv2.IMREAD_GRAYSCALE)
    # four by three cells, two by two a pixel; the row left over is at the highest y
    assert picture[22:-5, 5:7].tolist() == [[225, 225], [0, 0]]


@pytest.mark.parametrize("write", [write_top_view, write_slices])
def test_an_empty_volume_has_no_picture(tmp_path, write):
    with pytest.raises(OutputError, match="the volume is empty"):
        write(Octree(), tmp_path / "volume.png")


def test_all_files_are_written_together(lamp, tmp_path):
    target = tmp_path / "run"
    paths = write_volume(lamp, target, also=lambda folder: [save_volume(lamp, folder / "more.npz")])
    assert [path.name for path in paths] == [*VOLUME_FILES, "more.npz"]
    assert sorted(p.name for p in target.iterdir()) == sorted([*VOLUME_FILES, "more.npz"])


def test_earlier_volumes_are_replaced_only_when_asked(lamp, tmp_path):
    write_volume(lamp, tmp_path)
    with pytest.raises(UsageError, match=r"already holds volume.npz") as error:
        write_volume(lamp, tmp_path)
    assert error.value.hint == "use --overwrite to replace it"
    write_volume(lamp, tmp_path, overwrite=True)


def test_nothing_is_left_behind_where_something_cannot_be_written(tmp_path):
    with pytest.raises(OutputError, match="the volume is empty"):
        write_volume(Octree(0.1, Clamp()), tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_a_file_is_no_directory(tmp_path):
    (tmp_path / "run").write_text("")
    with pytest.raises(OutputError, match="run is a file"):
        check_folder(tmp_path / "run")
