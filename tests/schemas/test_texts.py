"""Text columns: cut at the first NUL, UTF-8 or read as Latin-1."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from attlog.schemas.texts import clean, replaced


def _expected(stored: bytes) -> bytes:
    text = stored.split(b"\0", 1)[0]
    try:
        text.decode()
    except UnicodeDecodeError:
        return text.decode("latin-1").encode()
    return text


@given(st.lists(st.binary(max_size=8), max_size=12))
def test_as_one_would_by_hand(values: list[bytes]) -> None:
    stored = np.array([value.ljust(8, b"\0") for value in values], "S8")
    cleaned = clean(stored)
    result = stored if cleaned is None else cleaned
    assert result.tolist() == [_expected(value) for value in values]


def test_only_what_changes_is_copied() -> None:
    data = np.zeros(2, [("a", "i4"), ("b", "S3")])
    assert clean(data["b"]) is None
    assert replaced(data, {}) is data
    changed = replaced(data, {"b": np.array([b"abcde", b"f"])})
    assert changed["b"].tolist() == [b"abcde", b"f"]
    assert changed["a"].tolist() == [0, 0]
