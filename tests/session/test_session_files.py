"""Session files that are older, newer, foreign or damaged: one line of cause, and the file as it was."""

import shutil
import sqlite3

import pytest
from session_worlds import WORDS, assert_same_results, interrupted, rows_of

from glassslam.cli import main
from glassslam.errors import OutputError, SessionError
from glassslam.session import Session, is_session, schema


@pytest.fixture(scope="module")
def waiting(bag, tmp_path_factory):
    """A directory in which a run into `run` waits to be gone on with, every row in the one file."""
    home = tmp_path_factory.mktemp("waiting")
    interrupted(["map", str(bag), "-o", str(home / "run"), *WORDS], after=40)
    with Session.open(home / "run.partial" / "session.db"):
        pass
    assert not (home / "run.partial" / "session.db-wal").exists()
    return home


@pytest.fixture
def session(waiting, tmp_path):
    """A copy of its session, in a directory of its own."""
    (tmp_path / "run.partial").mkdir()
    return shutil.copy(waiting / "run.partial" / "session.db", tmp_path / "run.partial" / "session.db")


FOREIGN = "is no session of glassslam (if it was one that is damaged: glassslam recover)"
BEGUN = "is empty: the run ended as it began (map the recording again)"


def changed(path, statement):
    database = sqlite3.connect(path, isolation_level=None)
    database.execute(statement)
    database.close()


def refused(path, capsys):
    """The line that is told when the run is to go on; what its file holds stays as it was."""
    before = path.read_bytes() if path.is_file() else None
    assert main(["map", "--resume", str(path.parent.with_suffix("")), "-q"]) == 1
    out, error = capsys.readouterr()
    assert out == ""
    assert error.startswith("error: ")
    assert error.endswith("\n")
    assert error.count("\n") == 1
    assert before is None or path.read_bytes() == before
    return error.removeprefix("error: ").removesuffix("\n")


def test_a_new_session_never_goes_into_a_file_that_is_there(tmp_path):
    path = tmp_path / "run.db"
    path.write_bytes(b"precious")
    with pytest.raises(OutputError) as caught:
        Session.create(path, [])
    assert caught.value.message == f"{path} exists already"
    assert caught.value.hint == "name a new file, or go on with it: Session.open"
    assert path.read_bytes() == b"precious"


def test_a_session_of_a_newer_version(session, capsys):
    changed(session, f"PRAGMA user_version = {schema.VERSION + 1}")
    assert is_session(session)
    assert refused(session, capsys) == (
        f"{session} was written by a newer glassslam (format {schema.VERSION + 1}; this one knows "
        f"{schema.VERSION}) (update glassslam)"
    )


def test_a_database_of_another_program(session, capsys):
    session.unlink()
    changed(session, "CREATE TABLE messages (data BLOB)")
    assert not is_session(session)
    assert refused(session, capsys) == (
        f"{session} is no session of glassslam: it is a database of another program"
    )


@pytest.mark.parametrize("content", [b"text\n" * 500, b"\x89PNG\r\n\x1a\n" + bytes(300), bytes(4096), b"S"])
def test_a_file_of_another_kind(session, capsys, content):
    session.write_bytes(content)
    assert not is_session(session)
    assert refused(session, capsys) == f"{session} {FOREIGN}"


def test_an_empty_file_is_a_run_that_ended_as_it_began(session, capsys):
    session.write_bytes(b"")
    assert not is_session(session)
    assert refused(session, capsys) == f"{session} {BEGUN}"


def test_a_session_that_was_never_filled(session, capsys):
    """What opening makes of a process that was killed while it made the file."""
    session.unlink()
    changed(session, f"PRAGMA application_id = {schema.APPLICATION_ID}")
    assert refused(session, capsys) == f"{session} {BEGUN}"


def test_a_directory_in_its_place(tmp_path, capsys):
    (tmp_path / "run.partial" / "session.db").mkdir(parents=True)
    assert main(["map", "--resume", str(tmp_path / "run")]) == 2
    assert capsys.readouterr().err == (
        f"error: there is no session for {tmp_path / 'run'} "
        "(name the results directory of a run: -o DIR of glassslam map)\n"
    )
    with pytest.raises(SessionError, match=r"cannot read .*session\.db: Is a directory"):
        Session.open(tmp_path / "run.partial" / "session.db")


def test_there_is_none(tmp_path, capsys):
    assert main(["map", "--resume", str(tmp_path / "run")]) == 2
    assert "there is no session for" in capsys.readouterr().err
    with pytest.raises(SessionError, match=r"there is no session .*x\.db") as raised:
        Session.open(tmp_path / "x.db")
    assert raised.value.hint == "it is written by glassslam map"


LENGTHS = [
    ("within the magic", lambda size: 10),
    ("within the header", lambda size: 60),
    ("the header alone", lambda size: 100),
    ("within the first page", lambda size: 2000),
    ("the first page", lambda size: 4096),
    ("within the tables", lambda size: 3 * 4096 + 11),
    ("half", lambda size: size // 2),
    ("all but a page", lambda size: size - 4096),
]


@pytest.mark.parametrize(("name", "length"), LENGTHS, ids=[name for name, _ in LENGTHS])
def test_a_session_that_was_cut(session, capsys, name, length):
    content = session.read_bytes()
    session.write_bytes(content[: length(len(content))])
    told = refused(session, capsys)
    if name == "within the magic":
        assert told == f"{session} {FOREIGN}"
    elif name == "within the header":
        assert told == f"{session} is damaged: it is cut off (save what there is: glassslam recover run)"
    else:
        assert told.startswith(f"{session} is damaged: ")
        assert told.endswith(" (save what there is: glassslam recover run)")


def test_a_session_that_lacks_its_last_byte(session, whole, capsys):
    """What the last page has lost may be padding."""
    session.write_bytes(session.read_bytes()[:-1])
    run = session.parent.with_suffix("")
    if main(["map", "--resume", str(run), "-q"]) == 0:
        assert_same_results(run, whole)
    else:
        assert capsys.readouterr().err.startswith(f"error: {session} is damaged: ")


@pytest.mark.parametrize("table", schema.TABLES)
def test_a_session_without_one_of_its_tables(session, capsys, table):
    changed(session, f"DROP TABLE {table}")
    assert refused(session, capsys) == (
        f"{session} is damaged: it has no table {table!r} (save what there is: glassslam recover run)"
    )


@pytest.mark.parametrize("name", ["config", "recordings", "options", "sonar", "glassslam"])
@pytest.mark.parametrize("what", ["DELETE FROM facts", "UPDATE facts SET value = '[1'"])
def test_a_session_that_does_not_tell_its_run(session, capsys, name, what):
    changed(session, f"{what} WHERE name = '{name}'")
    told = refused(session, capsys)
    assert told.startswith(f"{session} is damaged: it does not tell the recording (")
    assert told.endswith(" (save what there is: glassslam recover run)")


def test_a_byte_turned_anywhere_is_told_or_has_no_effect(session, whole, capsys):
    content, told = session.read_bytes(), 0
    run = session.parent.with_suffix("")
    for place in range(4096 + 2048, len(content), 3 * 4096 + 77):
        spoilt = bytearray(content)
        spoilt[place] ^= 0x55
        session.write_bytes(spoilt)
        code = main(["map", "--resume", str(run), "-q"])
        error = capsys.readouterr().err
        if code == 0:
            assert_same_results(run, whole)
            run.rename(session.parent)
        else:
            assert code == 1
            assert error.startswith(f"error: {session} is damaged: ")
            told += 1
        for aside in session.parent.glob("session.db-*"):
            aside.unlink()
    assert told >= 3


@pytest.fixture
def version_2(monkeypatch):
    def become(step):
        monkeypatch.setattr(schema, "VERSION", 2)
        monkeypatch.setattr(schema, "MIGRATIONS", {**schema.MIGRATIONS, 1: step})

    return become


def version(path):
    database = sqlite3.connect(path)
    found = database.execute("PRAGMA user_version").fetchone()[0]
    database.close()
    return found


def test_a_session_of_an_earlier_version_becomes_one_of_this(session, version_2):
    def step(database):
        database.execute("CREATE TABLE extra (a INTEGER)")

    version_2(step)
    for _ in range(2):  # the second time there is nothing to do
        with Session.open(session) as opened:
            assert opened.journal.scans == 39
    assert version(session) == 2


def test_a_step_that_fails_leaves_the_file_as_it_was(session, version_2):
    before = session.read_bytes()

    def step(database):
        database.execute("DROP TABLE nodes")
        database.execute("DROP TABLE of_nothing")

    version_2(step)
    with pytest.raises(SessionError, match="is damaged: no such table: of_nothing"):
        Session.open(session)
    assert version(session) == 1
    database = sqlite3.connect(session)
    assert rows_of(database, "nodes") > 0
    database.close()
    assert len(session.read_bytes()) == len(before)


def test_all_steps_are_made_or_none(session, monkeypatch):
    done = []

    def first(database):
        database.execute("CREATE TABLE extra (a INTEGER)")
        done.append(1)

    def second(database):
        done.append(2)
        raise sqlite3.OperationalError("no second step")

    monkeypatch.setattr(schema, "VERSION", 3)
    monkeypatch.setattr(schema, "MIGRATIONS", {1: first, 2: second})
    with pytest.raises(SessionError, match="no second step"):
        Session.open(session)
    assert done == [1, 2]
    assert version(session) == 1
    database = sqlite3.connect(session)
    assert database.execute("SELECT name FROM sqlite_schema WHERE name = 'extra'").fetchall() == []
    database.close()
    monkeypatch.undo()
    with Session.open(session) as opened:
        assert opened.journal.scans == 39
