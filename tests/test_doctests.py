"""The examples in the docstrings of both packages run and print what they say."""

import doctest
import importlib
import pkgutil

import pytest

import detectors
import glassslam


def modules():
    """Every module but the entry points, which run a program when imported."""
    for package in (glassslam, detectors):
        yield package.__name__
        for found in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            if not found.name.endswith("__main__"):
                yield found.name


def examples(name):
    """The docstrings with examples of a module, or a skip where an optional package is not installed."""
    try:
        module = importlib.import_module(name)
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] in ("glassslam", "detectors"):
            raise
        pytest.skip(f"{name} needs {error.name}")
    return [test for test in doctest.DocTestFinder().find(module, name) if test.examples]


@pytest.mark.parametrize("name", list(modules()))
def test_examples(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    runner = doctest.DocTestRunner(verbose=False, optionflags=doctest.NORMALIZE_WHITESPACE)
    for test in examples(name):
        report = []
        runner.run(test, out=report.append)
        assert not report, "".join(report)


def test_examples_are_found():
    assert {test.name for test in examples("glassslam.matching.gradient")} == {
        "glassslam.matching.gradient.match_scan"
    }
