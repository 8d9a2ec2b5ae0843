"""The program around the commands: help, errors, exit codes."""

import os
import signal
import subprocess
import sys

import pytest

from glassslam.cli import app, main
from glassslam.errors import RecordingError

PROGRAM = [sys.executable, "-c", "import sys; from glassslam.cli import main; sys.exit(main())"]


def run(*words, **options):
    return subprocess.run(
        [*PROGRAM, *words], check=False, capture_output=True, text=True, timeout=60, **options
    )


def raising(error):
    def fail(*_):
        raise error

    return fail


def test_help_lists_every_command_with_examples(capsys):
    assert main(["--help"]) == 0
    text = capsys.readouterr().out
    for name, (_, _, summary) in app.COMMANDS.items():
        assert f"  {name}" in text
        assert summary in text
    assert "glassslam map run.bag -o run-map" in text
    assert "Exit codes: 0 done" in text


def test_no_words_at_all_show_the_help(capsys):
    assert main([]) == 0
    assert "Commands:" in capsys.readouterr().out


@pytest.mark.parametrize("name", app.COMMANDS)
def test_every_command_has_help(capsys, name):
    assert main([name, "--help"]) == 0
    text = capsys.readouterr().out
    assert text.startswith(f"Usage: glassslam {name}")
    assert "Parameters" not in text
    assert main([name, "-h"]) == 0
    assert capsys.readouterr().out == text


def test_help_loads_nothing_heavy():
    heavy = {"numpy", "scipy", "numba", "casadi", "rosbags", "pydantic", "yaml", "matplotlib", "cv2", "rich"}
    code = (
        "import sys; from glassslam.cli import main; assert main(['--help']) == 0;"
        f"print(sorted({heavy!r} & set(sys.modules)), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr == "[]\n"


def test_version(capsys):
    assert main(["--version"]) == 0
    assert capsys.readouterr().out.startswith("glassslam 0.")


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["mapp"], "error: there is no command 'mapp' (did you mean 'map'?)"),
        (["zzz"], "error: there is no command 'zzz' (see glassslam --help)"),
        (["map"], "error: no recording is named (glassslam map RECORDING, or --resume DIR)"),
        (["--nonsense"], "error: No such option: --nonsense (see glassslam --help)"),
        (
            ["evaluate", "x.tum"],
            "error: nothing to compare with"
            " (give --relations FILE, --trajectory TUM, --glass FILE or --truth MAP)",
        ),
    ],
)
def test_wrong_usage_is_one_line_and_code_2(capsys, words, line):
    assert main(words) == 2
    captured = capsys.readouterr()
    assert captured.err == line + "\n"
    assert captured.out == ""


@pytest.mark.parametrize(
    ("error", "code", "line"),
    [
        (RecordingError("bad bag", "try another"), 1, "error: bad bag (try another)"),
        (RecordingError("two\nlines"), 1, "error: two lines"),
        (KeyboardInterrupt(), 130, "error: interrupted"),
        (app.Terminated(), 143, "error: terminated"),
        (PermissionError(13, "Permission denied", "x.bag"), 1, "error: x.bag: Permission denied"),
        (MemoryError(), 1, "error: out of memory (map a part of the recording: --duration, --every)"),
        (
            ZeroDivisionError("oops"),
            1,
            "error: unexpected ZeroDivisionError: oops "
            "(please report this; GLASSSLAM_DEBUG=1 shows where it happened)",
        ),
    ],
)
def test_every_failure_is_one_line_with_its_code(capsys, monkeypatch, error, code, line):
    monkeypatch.delenv("GLASSSLAM_DEBUG", raising=False)
    monkeypatch.setattr(app, "_run", raising(error))
    assert main(["map"]) == code
    assert capsys.readouterr().err == line + "\n"


def test_the_traceback_is_shown_on_demand(capsys, monkeypatch):
    monkeypatch.setenv("GLASSSLAM_DEBUG", "1")
    monkeypatch.setattr(app, "_run", raising(ZeroDivisionError("oops")))
    assert main(["map"]) == 1
    assert "Traceback (most recent call last)" in capsys.readouterr().err


def test_main_gives_the_signal_handler_back():
    before = signal.getsignal(signal.SIGTERM)
    main(["--version"])
    assert signal.getsignal(signal.SIGTERM) is before


@pytest.mark.parametrize(("number", "code", "word"), [(2, 130, "interrupted"), (15, 143, "terminated")])
def test_signals_end_the_program_with_their_code(number, code, word):
    program = (
        "import os, sys, time; from glassslam.cli import app\n"
        f"def wait(words): os.kill(os.getpid(), {number}); time.sleep(30)\n"
        "app._run = wait; sys.exit(app.main(['map']))"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], check=False, capture_output=True, text=True, timeout=60
    )
    assert (done.returncode, done.stderr) == (code, f"error: {word}\n")


def test_a_reader_that_goes_away_is_no_error():
    read_end, write_end = os.pipe()
    os.close(read_end)
    done = subprocess.run(
        [*PROGRAM, "config"], check=False, stdout=write_end, stderr=subprocess.PIPE, text=True, timeout=60
    )
    os.close(write_end)
    assert (done.returncode, done.stderr) == (0, "")


def test_closed_standard_output_is_no_error():
    done = subprocess.run(
        ["sh", "-c", 'exec "$0" "$@" >&-', *PROGRAM, "config"],
        check=False,
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs /dev/full")  # noqa: PTH110
def test_a_full_standard_output_is_told():
    with open("/dev/full", "w") as full:  # noqa: PTH123
        done = subprocess.run(
            [*PROGRAM, "config"], check=False, stdout=full, stderr=subprocess.PIPE, text=True, timeout=60
        )
    assert done.returncode == 1
    assert done.stderr == "error: cannot write to standard output: No space left on device\n"


def test_names_that_the_terminal_cannot_show_are_escaped():
    done = run(
        "evaluate", "caf\u00e9.tum", "--relations", "x", env={**os.environ, "PYTHONIOENCODING": "ascii"}
    )
    assert done.returncode == 1
    assert done.stderr == "error: cannot read caf\\xe9.tum: No such file or directory\n"


def test_the_package_is_a_program_as_well():
    done = subprocess.run(
        [sys.executable, "-m", "glassslam", "--version"], check=False, capture_output=True, text=True
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("glassslam 0.")


def test_an_interruption_while_the_program_is_loaded_is_one_line():
    code = (
        "import sys\n"
        "class Impatient:\n"
        "    def find_spec(self, name, *_):\n"
        "        if name == 'glassslam.cli.app':\n"
        "            raise KeyboardInterrupt\n"
        "sys.meta_path.insert(0, Impatient())\n"
        "from glassslam.cli import main\n"
        "sys.exit(main())\n"
    )
    done = subprocess.run([sys.executable, "-c", code], check=False, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (130, "error: interrupted\n")
