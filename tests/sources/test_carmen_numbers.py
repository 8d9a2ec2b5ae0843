"""The number kernel reads what the standard library reads, to the last bit."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from glassslam.sources.carmen_kernels import parse_decimals
from glassslam.sources.carmenlines import NumberReader, read_any

plain = st.one_of(
    st.integers(-(10**6), 10**6).map(str),
    st.decimals(-(10**4), 10**4, places=6).map(str),
    st.decimals(10**8, 2 * 10**9, places=6).map(str),
    st.sampled_from(["0", "-0.0", "1.", ".5", "-.25", "007", "81.83"]),
)
words = st.sampled_from(
    ["nohost", "1e5", "nan", "-", ".", "1.2.3", "127.0.0.1", "12345678901234567890", "+1", "1-2"]
)


def parse(line, start=0, size=64):
    out = np.full(size, np.nan)
    count = parse_decimals(np.frombuffer(line, dtype=np.uint8), start, out)
    return out[:count]


@given(st.lists(plain, max_size=20), st.sampled_from([" ", "  ", "\t"]), st.sampled_from(["", "\n", " \r\n"]))
def test_equals_the_naive_reader(tokens, blank, end):
    line = (blank.join(["TAG", *tokens]) + end).encode()
    expected = np.array([float(token) for token in tokens])
    np.testing.assert_array_equal(parse(line, 3), expected)
    np.testing.assert_array_equal(read_any(line, 3), expected)


@given(st.lists(plain, max_size=8), words, st.lists(plain, max_size=3))
def test_stops_at_the_first_other_token(before, word, after):
    line = " ".join([*before, word, *after]).encode()
    np.testing.assert_array_equal(parse(line), np.array([float(token) for token in before]))


def test_stops_when_the_space_is_full():
    assert parse(b"1 2 3 4", size=3).tolist() == [1.0, 2.0, 3.0]


def test_the_reader_grows_with_the_line():
    numbers = np.arange(5000.0)
    line = " ".join(map(str, numbers)).encode()
    np.testing.assert_array_equal(NumberReader().read(line, 0), numbers)


def test_the_reader_tries_exotic_numbers_only_when_needed():
    reader = NumberReader()
    assert reader.read(b"1 2e1 3", 0).tolist() == [1.0]
    assert reader.read(b"1 2e1 3 host 4", 0, 3).tolist() == [1.0, 20.0, 3.0]
