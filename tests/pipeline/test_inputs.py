"""Which files a call means, and where results go."""

from pathlib import Path

import pytest

from attlog.pipeline.inputs import MCAP_MAGIC, check_target, expand, is_mcap, outputs
from attlog.schemas import StorageError, UsageError


def _touch(folder: Path, *names: str) -> list[Path]:
    made = [folder / name for name in names]
    for path in made:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(MCAP_MAGIC if path.suffix == ".mcap" else b"x")
    return made


def test_a_folder_gives_what_is_accepted_at_any_depth(tmp_path: Path) -> None:
    a, b, _, _ = _touch(tmp_path, "a.mcap", "deep/er/b.mcap", "c.txt", ".hidden/d.mcap")
    assert expand([tmp_path], is_mcap) == [a, b]


def test_a_glob_gives_its_matches_and_nothing_twice(tmp_path: Path) -> None:
    a, b, c = _touch(tmp_path, "a.mcap", "b.mcap", "x/c.mcap")
    assert expand([str(tmp_path / "*.mcap"), a], is_mcap) == [a, b]
    assert expand([str(tmp_path / "**" / "*.mcap")], is_mcap) == [a, b, c]


def test_a_named_file_is_kept_whatever_it_is(tmp_path: Path) -> None:
    (text,) = _touch(tmp_path, "notes[1].txt")
    missing = tmp_path / "missing.mcap"
    assert expand([text, missing, str(tmp_path / "nil*")], is_mcap) == [text, missing, tmp_path / "nil*"]


def test_results_lie_beside_their_sources(tmp_path: Path) -> None:
    assert outputs([tmp_path / "f.tlog"], None) == [tmp_path / "f.mcap"]
    assert outputs([tmp_path / "f.tlog"], "here.mcap") == [Path("here.mcap")]
    assert outputs([tmp_path / "f.tlog"], tmp_path) == [tmp_path / "f.mcap"]
    assert outputs([tmp_path / "f.tlog"], "new/") == [Path("new/f.mcap")]


def test_two_that_would_be_one_file_keep_their_suffix() -> None:
    sources = [Path("f.tlog"), Path("f.bin"), Path("g.bin")]
    assert outputs(sources, None) == [Path("f.tlog.mcap"), Path("f.bin.mcap"), Path("g.mcap")]


def test_the_same_name_in_two_folders_takes_the_folder_along() -> None:
    made = outputs([Path("/one/f.bin"), Path("/two/f.bin")], "out")
    assert made == [Path("out/one_f.bin.mcap"), Path("out/two_f.bin.mcap")]


def test_several_sources_need_a_folder(tmp_path: Path) -> None:
    (file,) = _touch(tmp_path, "one.mcap")
    with pytest.raises(UsageError, match="folder"):
        outputs([Path("a.bin"), Path("b.bin")], file)


def test_an_output_that_exists_is_safe(tmp_path: Path) -> None:
    source, target = _touch(tmp_path, "a.bin", "a.mcap")
    with pytest.raises(StorageError, match="--force"):
        check_target(target, source, force=False)
    check_target(target, source, force=True)
    with pytest.raises(StorageError, match="source itself"):
        check_target(source, source, force=True)


def test_an_empty_name_is_no_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    _touch(tmp_path, "a.mcap")
    monkeypatch.chdir(tmp_path)
    for nothing in ("", " "):
        with pytest.raises(UsageError, match="empty"):
            expand([nothing], is_mcap)


def test_a_log_that_is_left_out_of_a_folder_is_told(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    (a,) = _touch(tmp_path, "a.mcap")
    _touch(tmp_path, "readme.txt", "torn.tlog")
    assert expand([tmp_path], is_mcap) == [a]
    assert "torn.tlog" in caplog.text
    assert "readme" not in caplog.text
