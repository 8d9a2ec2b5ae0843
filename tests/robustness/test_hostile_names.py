"""Recordings made to do harm: nothing of them is run, and nothing is written outside of the target."""

import ast
import sys
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parents[1] / "sources"))
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from tiny_bags import ROS1, ROS2, T0, odom, scan, tf

from glassslam.cli import main
from glassslam.cli.terminal import complain, emit

ROOT = Path(__file__).parents[2]
SOURCES = sorted([*(ROOT / "glassslam").rglob("*.py"), *(ROOT / "detectors").rglob("*.py")])
BEAMS = [2.0, 2.5, 3.0] * 30
LOG = "".join(
    f"FLASER 90 {' '.join(['2.0'] * 45 + ['2.5'] * 45)} {k / 10} 0 0 {k / 10} 0 0 {k}.5 host {k}.5\n"
    for k in range(12)
)
HOSTILE = "../../../evil\x1b]0;owned\x07<script>alert(1)</script>"

# Each is a way to run what a file says, or to build any object it names.
FORBIDDEN_MODULES = {"pickle", "cPickle", "_pickle", "dill", "marshal", "shelve", "joblib", "cloudpickle"}
FORBIDDEN_CALLS = {
    "eval", "exec", "__import__", "os.system", "os.popen", "yaml.load", "yaml.load_all", "yaml.full_load",
    "yaml.full_load_all", "yaml.unsafe_load", "yaml.unsafe_load_all", "np.fromregex", "numpy.load",
}  # fmt: skip


def name_of(node):
    return (
        f"{name_of(node.value)}.{node.attr}" if isinstance(node, ast.Attribute) else getattr(node, "id", "")
    )


def misuses(tree):
    """What of a module could run or build what a file says."""
    for node in ast.walk(tree):
        match node:
            case ast.Import():
                yield from (n.name for n in node.names if n.name.split(".")[0] in FORBIDDEN_MODULES)
            case ast.ImportFrom():
                if (node.module or "").split(".")[0] in FORBIDDEN_MODULES:
                    yield node.module
            case ast.Call():
                name, options = name_of(node.func), {k.arg: k.value for k in node.keywords}
                shell, pickled = options.get("shell"), options.get("allow_pickle")
                if name in FORBIDDEN_CALLS or (shell is not None and getattr(shell, "value", 1)):
                    yield name
                if name == "np.load" and getattr(pickled, "value", True) is not False:
                    yield "np.load without allow_pickle=False"


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(ROOT)))
def test_no_module_runs_or_builds_what_a_file_says(path):
    assert list(misuses(ast.parse(path.read_text(encoding="utf-8")))) == []


@pytest.mark.parametrize(
    "line",
    [
        "import pickle", "from pickle import loads", "eval('1')", "yaml.load(text)", "np.load(path)",
        "np.load(path, allow_pickle=True)", "subprocess.run(x, shell=True)", "os.system('ls')",
    ],
)  # fmt: skip
def test_the_search_finds_what_it_looks_for(line):
    assert len(list(misuses(ast.parse(line)))) == 1


def hostile_drive():
    """Frames and topics with names that lead out of the folder, command a terminal, or are HTML."""
    mount = tf(0.0, "base_link", HOSTILE, (0.2, 0.0, 0.0), topic="/tf_static")
    steps = [
        message
        for k in range(12)
        for message in (
            odom(k / 10, 0.05 * k, topic=f"/{HOSTILE}/odom", child="base_link"),
            scan(k / 10 + 0.01, BEAMS, topic=f"/{HOSTILE}", frame=HOSTILE, intensities=range(90)),
        )
    ]
    return [mount, *steps]


def write(path, messages, storage, definition=lambda text: text):
    """A bag with changed message definitions."""
    store = ROS1 if storage == "ROS1" else ROS2
    writer = (
        Writer1(path)
        if storage == "ROS1"
        else Writer2(path, version=9, storage_plugin=StoragePlugin[storage])
    )
    serialize = store.serialize_ros1 if storage == "ROS1" else store.serialize_cdr
    with writer:
        connections = {}
        for sent in messages:
            key = (sent.topic, sent.msgtype)
            if key not in connections:
                text, digest = store.generate_msgdef(sent.msgtype)
                options = {"msgdef": definition(text)}
                options |= {"md5sum": digest} if storage == "ROS1" else {"rihs01": digest}
                connections[key] = writer.add_connection(*key, **options)
            raw = serialize(sent.build(store), sent.msgtype)
            writer.write(connections[key], T0 * 10**9 + round(sent.at * 1e9), raw)
    return path


@pytest.mark.parametrize("storage", ["ROS1", "SQLITE3", "MCAP"])
def test_names_of_a_recording_never_become_paths_or_commands(tmp_path, storage, capsys):
    folder = tmp_path / "a" / "b" / "c"
    folder.mkdir(parents=True)
    bag = write(folder / "run", hostile_drive(), storage)
    assert main(["inspect", str(bag)]) == 0
    assert main(["map", str(bag), "-o", str(folder / "out"), "--set", "glass.detector=narrow_return"]) == 0
    captured = capsys.readouterr()
    assert "evil" in captured.out
    assert not set(captured.out + captured.err) & {"\x1b", "\x07"}
    assert sorted(p.name for p in folder.iterdir()) == ["out", "run"]
    assert [p.name for p in tmp_path.rglob("*") if "evil" in p.name] == []
    page = (folder / "out" / "report.html").read_text()
    assert "<script>alert" not in page
    assert "&lt;script&gt;alert" in page


INJECTIONS = (
    "string X=\"\"\"; open('{}', 'w') #\n",
    "string X='+str(open('{}', 'w'))+'\n",
    "float32 y); open('{}', 'w') #\n",
    "================================================================================\n"
    "MSG: std_msgs/Header: pass\nopen('{}', 'w')\n",
    "int32 X=__import__('os').system('touch {}')\n",
)


@pytest.mark.parametrize("storage", ["ROS1", "SQLITE3", "MCAP"])
@pytest.mark.parametrize("injection", INJECTIONS)
def test_definitions_of_messages_are_never_run(tmp_path, storage, injection):
    canary = tmp_path / "canary"
    messages = [message for k in range(12) for message in (odom(k / 10), scan(k / 10, BEAMS))]
    bag = write(tmp_path / "run", messages, storage, lambda text: injection.format(canary) + text)
    main(["map", str(bag), "-o", str(tmp_path / "out"), "--quiet"])
    bag = write(tmp_path / "run2", messages, storage, lambda text: text + "\n" + injection.format(canary))
    main(["map", str(bag), "-o", str(tmp_path / "out"), "--quiet", "--overwrite"])
    assert not canary.exists()


def test_links_in_earlier_results_are_not_followed(tmp_path):
    """Somebody may have put links in the folder that lead to what must not be written over."""
    letter, out = tmp_path / "letter", tmp_path / "out"
    letter.write_text("dear friend")
    log = tmp_path / "run.log"
    log.write_text(LOG)
    out.mkdir()
    for name in ("map.pgm", "map.yaml", "report.html", "report.json", "config.yaml"):
        (out / name).symlink_to(letter)
    assert main(["map", str(log), "-o", str(out), "--overwrite", "--quiet"]) == 0
    assert letter.read_text() == "dear friend"
    assert not (out / "map.pgm").is_symlink()


def test_a_link_in_the_place_of_a_lock_is_not_followed(tmp_path):
    letter = tmp_path / "letter"
    letter.write_text("dear friend")
    (tmp_path / ".out.lock").symlink_to(letter)
    log = tmp_path / "run.log"
    log.write_text(LOG)
    assert main(["map", str(log), "-o", str(tmp_path / "out"), "--quiet"]) == 0
    assert letter.read_text() == "dear friend"


@pytest.mark.parametrize("text", ["\x1b[2J", "\x1b]0;title\x07", "\x9b2J", "a\x08b", "\x7f"])
def test_no_text_commands_the_terminal(text, capsys):
    emit(f"{text}\n")
    complain(text, text, code=1)
    captured = capsys.readouterr()
    for line in (captured.out, captured.err):
        assert all(character.isprintable() or character == "\n" for character in line)
        assert "\\x" in line


def test_colours_stay(capsys):
    emit("\x1b[1;31mred\x1b[0m\n")
    assert capsys.readouterr().out == "\x1b[1;31mred\x1b[0m\n"


def test_nothing_is_left_in_the_working_directory(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    bag = write(tmp_path / "run", hostile_drive(), "ROS1")
    main(["map", str(bag), "-o", "out", "--quiet"])
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out", "run"]
