"""Every card of a public data set can be read, fits the files it describes, and errors name the place."""

import pytest

from glassslam.cards import DatasetCard, cards, datasets_folder
from glassslam.config import Config
from glassslam.errors import ConfigError, RecordingError

CARDS = sorted(path.stem for path in datasets_folder().glob("*.yaml"))

CARD = """
name: {name}
title: A room
what: One lap.
source: {{published: nowhere}}
sensor: {{model: x, beams: '5', field_of_view_deg: 180, rate_hz: 5, range_max: 8, no_echo: inf,
  intensities: none}}
odometry: none
truth: none
files: [{{path: room/a.bag, bytes: 3, format: rosbag1,
  sha256: ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad}}]
"""


def write(tmp_path, text, name="room"):
    path = tmp_path / f"{name}.yaml"
    path.write_text(text.format(name="room"), encoding="utf-8")
    return path


def test_the_classic_logs_and_the_glass_recordings_have_cards():
    wanted = {
        "intel",
        "aces",
        "mit-csail",
        "mit-killian",
        "pi-map",
        "glass-corridor",
        "museum-b0",
        "turtlebot3",
    }
    assert wanted <= set(CARDS)
    assert [card.name for card in cards()] == CARDS


@pytest.mark.parametrize("name", CARDS)
def test_every_card_is_whole(name):
    card = DatasetCard.load(datasets_folder() / f"{name}.yaml")
    assert card.name == name
    assert any(file.role == "recording" for file in card.files)
    assert len({file.path for file in card.files}) == len(card.files)
    assert card.source.address.startswith(("http://", "https://")) or not card.source.address
    assert isinstance(card.config(), Config)


@pytest.mark.parametrize("name", CARDS)
def test_every_card_describes_the_files_at_hand(name, data_dir):
    DatasetCard.load(datasets_folder() / f"{name}.yaml").check(data_dir)


def test_a_file_that_fits_passes_and_another_one_is_refused(tmp_path):
    card = DatasetCard.load(write(tmp_path, CARD))
    with pytest.raises(RecordingError) as caught:
        card.check(tmp_path)
    assert caught.value.message == f"{tmp_path / 'room' / 'a.bag'} is missing"
    assert caught.value.hint == "published with: nowhere"
    (tmp_path / "room").mkdir()
    (tmp_path / "room" / "a.bag").write_bytes(b"abc")
    card.check(tmp_path)
    (tmp_path / "room" / "a.bag").write_bytes(b"abd")
    with pytest.raises(RecordingError, match=r"a\.bag is not the file card 'room' describes"):
        card.check(tmp_path)


@pytest.mark.parametrize(
    ("text", "message", "hint"),
    [
        (CARD + "licence: MIT\n", "unknown name 'licence'", "known here: name, title, what, "),
        (CARD.replace("rate_hz", "rate_Hz"), "sensor.rate_hz: Field required", ""),
        (CARD.replace("ba7816", "xyz"), "files.0.sha256: String should match pattern", "found 'xyzbf8f"),
        (CARD + "truht: x\n", "unknown name 'truht'", "did you mean 'truth'?"),
        (
            CARD.replace("path: room/a.bag,", "path: room/a.bag, bites: 4,"),
            "unknown name 'files.0.bites'",
            "did you mean 'bytes'?",
        ),
        (
            CARD.replace("published: nowhere", "published: nowhere, adress: x"),
            "unknown name 'source.adress'",
            "did you mean 'address'?",
        ),
    ],
)
def test_an_unfit_card_is_refused_with_the_place(tmp_path, text, message, hint):
    path = write(tmp_path, text)
    with pytest.raises(ConfigError) as caught:
        DatasetCard.load(path)
    assert caught.value.message.startswith(f"{path}: {message}")
    assert caught.value.hint.startswith(hint)


def test_a_card_must_bear_the_name_of_its_file(tmp_path):
    with pytest.raises(ConfigError, match=r"other\.yaml: the card is named 'room'"):
        DatasetCard.load(write(tmp_path, CARD, "other"))


def test_a_card_with_an_unfit_configuration_is_refused(tmp_path):
    text = CARD + "configuration: {{sensor: {{max_rnge: 8}}}}\n"
    with pytest.raises(ConfigError, match=r"card room: unknown parameter 'sensor\.max_rnge'"):
        DatasetCard.load(write(tmp_path, text))


def test_an_incomplete_installation_is_said_to_be_so(monkeypatch, tmp_path):
    monkeypatch.setattr("glassslam.cards.__file__", str(tmp_path / "site" / "glassslam" / "cards.py"))
    with pytest.raises(ConfigError) as caught:
        datasets_folder()
    assert caught.value.message == "the data sets that ship with glassslam are missing"
    assert caught.value.hint == "install the package again"
