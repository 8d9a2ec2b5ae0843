"""The program `glassslam`: finds the command, runs it, turns errors into one line and an exit code."""

import difflib
import inspect
import os
import re
import signal
import sys
import threading
import traceback
from collections.abc import Sequence
from importlib import import_module
from itertools import pairwise
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from glassslam.cli.interruption import Terminated
from glassslam.cli.terminal import complain, discard_output, emit
from glassslam.errors import GlassSlamError, UsageError

# name -> (module, function, summary). The summaries stand here so that --help loads no command.
COMMANDS = {
    "map": ("glassslam.cli.map", "map_command", "Make a map from a recording."),
    "render": ("glassslam.cli.render", "render", "Draw the results of a run again, without SLAM."),
    "recover": ("glassslam.cli.recover", "recover", "Save what is left of a damaged session."),
    "inspect": ("glassslam.cli.inspect", "inspect", "Show what is in a recording and what map would use."),
    "calibrate": ("glassslam.cli.calibrate", "calibrate_command", "Calibrate a lidar for glass."),
    "evaluate": ("glassslam.cli.evaluate", "evaluate", "Compare a trajectory with the truth."),
    "volume": ("glassslam.cli.volume", "volume", "Make a 3D map from lidar and ultrasonic points."),
    "simulate": ("glassslam.cli.simulate", "simulate", "Write a recording of a simulated building."),
    "demo": ("glassslam.cli.demo", "demo", "Simulate a recording, map it, evaluate it."),
    "config": ("glassslam.cli.config", "config", "Print or compare configurations."),
}

_EXAMPLES = """\b
Examples:
  glassslam demo                               simulate a building and map it
  glassslam inspect run.bag                    what is in the recording?
  glassslam map run.bag -o run-map             make the map
  glassslam render run-map --set map.resolution=0.02
  glassslam evaluate run-map --relations F     how good is it?
  glassslam map --help                         all options of a command

\b
Exit codes: 0 done, 1 failed, 2 wrong usage or configuration,
3 done but part of the input was damaged or dropped, 130/143 interrupted.
"""

_HELP = {"help_option_names": ["-h", "--help"]}
_USAGE_ERROR: type[Exception] = typer.BadParameter.__bases__[0]


class LazyGroup(TyperGroup):
    """Commands that are imported when they are called."""

    def list_commands(self, ctx: Any) -> list[str]:  # noqa: ARG002  (the signature of the base)
        """Names of the commands, in the order of the help."""
        return list(COMMANDS)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:  # noqa: ARG002
        """Import one command; None where there is none of that name."""
        return load_command(cmd_name) if cmd_name in COMMANDS else None

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Find the command of the given words; a misspelt one is met with the nearest name."""
        if args[0] not in COMMANDS and not args[0].startswith("-"):
            near = difflib.get_close_matches(args[0], COMMANDS, n=1)
            hint = f"did you mean {near[0]!r}?" if near else "see glassslam --help"
            raise UsageError(f"there is no command {args[0]!r}", hint)
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: Any, formatter: Any) -> None:  # noqa: ARG002
        """List the commands without importing them."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, summary) for name, (_, _, summary) in COMMANDS.items()])


def load_command(name: str) -> Any:
    """Build one command from its function; a text EXAMPLES in its module ends the help."""
    module_name, function_name, _ = COMMANDS[name]
    module = import_module(module_name)
    function = getattr(module, function_name)
    text = re.split(r"\n\n\w+\n-{3,}\n", inspect.getdoc(function) or "")[0]
    examples = getattr(module, "EXAMPLES", "")
    single = typer.Typer(add_completion=False, rich_markup_mode=None)
    single.command(
        name, context_settings=_HELP, help=text, epilog=f"\b\nExamples:\n{examples}" if examples else None
    )(function)
    return typer.main.get_command(single)


def _show_version(wanted: bool) -> None:
    if wanted:
        import glassslam  # noqa: PLC0415  (the version is looked up only here)

        emit(f"glassslam {glassslam.__version__}\n")
        raise typer.Exit


def build_app() -> Any:
    """Build the command group of the whole program."""
    app = typer.Typer(cls=LazyGroup, context_settings=_HELP, add_completion=False, rich_markup_mode=None)

    @app.callback(help="Offline 2D lidar SLAM: from a recording to a loop-closed map.", epilog=_EXAMPLES)
    def _root(
        version: Annotated[
            bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version.")
        ] = False,
    ) -> None:
        pass

    return typer.main.get_command(app)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    arguments : sequence of str, optional
        The words after the program's name; those of the process when left out.

    Returns
    -------
    int
        0 done, 1 failed, 2 usage or configuration, 3 done but data was dropped, 130 or 143 interrupted.
    """
    words = list(sys.argv[1:] if arguments is None else arguments) or ["--help"]
    previous = _catch_sigterm()
    try:
        return _run(words)
    except BaseException as error:
        if os.environ.get("GLASSSLAM_DEBUG") == "1" and not isinstance(error, _USAGE_ERROR):
            traceback.print_exc()
        return _explain(error)
    finally:
        if previous is not None:
            signal.signal(signal.SIGTERM, previous)


def _run(words: list[str]) -> int:
    _check_words(words)
    code = build_app().main(args=words, prog_name="glassslam", standalone_mode=False)
    if code == 130:
        raise KeyboardInterrupt
    return code if isinstance(code, int) else 0


def _check_words(words: list[str]) -> None:
    """An empty path would be the working directory, which nobody means who has mistyped a variable."""
    for before, word in pairwise(["glassslam", *words]):
        if not word or re.fullmatch(r"--[\w-]+=", word):
            raise UsageError(
                f"an empty argument {f'in {word}' if word else f'after {before}'}",
                "perhaps a variable of the shell that is not set",
            )


def _catch_sigterm() -> Any:
    if threading.current_thread() is not threading.main_thread():
        return None

    def end(*_: Any) -> None:
        raise Terminated

    return signal.signal(signal.SIGTERM, end)


def _explain(error: BaseException) -> int:
    if isinstance(error, GlassSlamError):
        return complain(error.message, error.hint, code=error.exit_code)
    if isinstance(error, _USAGE_ERROR):
        return _explain_usage(error)
    if isinstance(error, BrokenPipeError):
        discard_output()
        return 1
    message, hint, code = _describe(error)
    return complain(message, hint, code=code)


def _describe(error: BaseException) -> tuple[str, str, int]:
    match error:
        case KeyboardInterrupt() | typer.Abort():
            return "interrupted", "", 130
        case Terminated():
            return "terminated", "", 143
        case OSError():
            return f"{error.filename or 'system'}: {error.strerror or error}", "", 1
        case MemoryError():
            return "out of memory", "map a part of the recording: --duration, --every", 1
    if not isinstance(error, Exception):
        raise error
    return (
        f"unexpected {type(error).__name__}: {error}",
        "please report this; GLASSSLAM_DEBUG=1 shows where it happened",
        1,
    )


def _explain_usage(error: Any) -> int:
    command = error.ctx.command_path if getattr(error, "ctx", None) else "glassslam"
    return complain(error.format_message().rstrip("."), f"see {command} --help", code=2)
