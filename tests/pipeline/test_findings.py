"""Findings and notes to channels and back, and how a person writes a time."""

from pathlib import Path

import pytest

from attlog.pipeline.annotate import moment_ns, notes_from_csv, severity_of
from attlog.pipeline.findings import both, findings_columns, findings_from, mirror, notes_columns, notes_from, replaced
from attlog.schemas import Finding, InputError, Kind, Note, Severity, UsageError

GAP = Finding(
    2_000_000_001, 2_500_000_000, Severity.WARN, Kind.GAP, "/imu0/data_raw", 0.5, "s", "samples are missing ± ö"
)
RESET = Finding(
    1_000_000_000, 1_000_000_000, Severity.ERROR, Kind.RESET, "/estimate/ecf/attitude", 1.0, "", "restarted"
)


def test_findings_come_back_in_order_of_time() -> None:
    assert findings_from(findings_columns([GAP, RESET])) == [RESET, GAP]
    assert findings_from(None) == []


def test_notes_come_back_with_their_ends() -> None:
    notes = [
        Note(5, Severity.INFO, "note", "first"),
        Note(7, Severity.FATAL, "note", "until", 9_000_000_000_000_000_001),
    ]
    assert notes_from(notes_columns(notes)) == notes


def test_findings_are_mirrored_once() -> None:
    note = Note(3, Severity.INFO, "statustext", "Arming motors")
    once = both([GAP], [note])
    again = both(findings_from(once[0]), notes_from(once[1]))
    assert notes_from(again[1]) == notes_from(once[1]) == [note, mirror(GAP)]
    assert both([], []) == []


def test_a_remade_channels_findings_give_way() -> None:
    new = Finding(5, 6, Severity.WARN, Kind.RESET, "/estimate/ecf/attitude", 1.0, "", "again")
    left = replaced([GAP, RESET], [new, GAP], "/estimate/ecf/attitude".__eq__)
    assert findings_from(both(left, [])[0]) == [new, GAP]


@pytest.mark.parametrize(
    ("spelled", "after_ns"),
    [
        ("12.3s", 12_300_000_000),
        ("12.3", 12_300_000_000),
        ("1m5s", 65_000_000_000),
        ("250ms", 250_000_000),
        ("2h", 7_200_000_000_000),
        ("0", 0),
    ],
)
def test_times_after_the_start(spelled: str, after_ns: int) -> None:
    assert moment_ns(spelled, 1_000) == 1_000 + after_ns


def test_times_as_dates() -> None:
    assert moment_ns("1970-01-01T00:00:10Z", 99) == 10_000_000_000
    assert moment_ns("1970-01-01T02:00:10.25+02:00", 99) == 10_250_000_000


@pytest.mark.parametrize("spelled", ["", "soon", "-3s", "12.3 parsec", "2015-06-11T12:13:14"])
def test_what_is_no_time(spelled: str) -> None:
    with pytest.raises(UsageError):
        moment_ns(spelled, 0)


def test_severities() -> None:
    assert severity_of("warn") is Severity.WARN
    with pytest.raises(UsageError, match="fatal"):
        severity_of("dreadful")


def test_a_csv_of_notes(tmp_path: Path) -> None:
    path = tmp_path / "notes.csv"
    path.write_text('at,to,severity,text\n1s,2s,warn,"a, b"\n3s,,,plain\n', encoding="utf-8-sig")
    first, second = notes_from_csv(path)
    assert (first.at, first.to, first.severity, first.text) == ("1s", "2s", "warn", "a, b")
    assert (second.to, second.severity) == (None, "info")
    path.write_text("when,what\n1,x\n")
    with pytest.raises(InputError, match="header"):
        notes_from_csv(path)
    path.write_text("at,text\n,x\n")
    with pytest.raises(InputError, match="line 2"):
        notes_from_csv(path)
