"""docs/robustness.md names a test for every row, and every test that it names is there."""

import ast
import re
from pathlib import Path

import pytest

TESTS = Path(__file__).parents[1]
TEXT = (TESTS.parent / "docs" / "robustness.md").read_text(encoding="utf-8")
ROWS = [line for line in TEXT.splitlines() if line.startswith("|") and line.count("|") == 4]
ENTRIES = [row for row in ROWS if not re.match(r"\| What|\|---", row)]


def functions(path):
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.ClassDef)}


@pytest.mark.parametrize("row", ENTRIES, ids=[entry.split("|")[1].strip()[:50] for entry in ENTRIES])
def test_every_row_names_tests_that_exist(row):
    words = re.findall(r"`([^`]+)`", row.split("|")[3])
    file = None
    assert words
    for word in words:
        if word.endswith(".py"):
            places = [TESTS / word] if "/" in word else [TESTS / "robustness" / word, TESTS / word]
            file = next((place for place in places if place.exists()), None)
            assert file is not None, word
        else:
            assert word in functions(file), word


def test_there_are_many():
    assert len(ENTRIES) > 60
