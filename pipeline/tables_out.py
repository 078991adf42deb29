"""Tables as files of a folder: all of them appear, or none."""

import contextlib
import json
import os
import secrets
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..schemas.errors import StorageError

if TYPE_CHECKING:
    import pyarrow as pa

SUFFIXES: Mapping[str, str] = {"parquet": ".parquet", "csv": ".csv"}


@contextmanager
def written_together(folder: Path, names: Sequence[str], force: bool) -> Iterator[Callable[[str, "pa.Table"], None]]:
    """A function that writes a table to a name of the folder; the files take their names when the block ends well.

    StorageError where one of ``names`` exists (unless ``force``) or the disk refuses; then nothing is left behind.
    """
    there = [name for name in names if (folder / name).exists()]
    if there and not force:
        raise StorageError(
            f"{folder / there[0]}: exists already; give --force to replace it, or another folder with -o"
        )
    made = [parent for parent in (folder, *folder.parents) if not parent.exists()]
    beside: dict[str, Path] = {}

    def write(name: str, table: "pa.Table") -> None:
        beside[name] = folder / f".attlog-{os.getpid()}-{secrets.token_hex(4)}.part"
        _WRITERS[Path(name).suffix](table, beside[name])

    try:
        folder.mkdir(parents=True, exist_ok=True)
        yield write
        for name in list(beside):
            os.replace(beside[name], folder / name)
            del beside[name]
    except BaseException as error:
        _undo(beside, made)
        if isinstance(error, OSError):
            raise StorageError(f"{folder}: cannot be written: {error.strerror or error}") from error
        raise


def _undo(beside: Mapping[str, Path], made: Sequence[Path]) -> None:
    for path in beside.values():
        path.unlink(missing_ok=True)
    for parent in made:
        with contextlib.suppress(OSError):  # not empty: someone else's
            parent.rmdir()


def _parquet(table: "pa.Table", path: Path) -> None:
    import pyarrow.parquet as pq

    pq.write_table(table, path, compression="zstd")


def _csv(table: "pa.Table", path: Path) -> None:
    import pyarrow as pa
    import pyarrow.csv as pc

    names, arrays = [], []
    for field, column in zip(table.schema, table.columns, strict=True):
        unit = (field.metadata or {}).get(b"unit", b"").decode()
        names.append(f"{field.name} [{unit}]" if unit and field.name != "time_ns" else field.name)
        nested = pa.types.is_nested(field.type) or pa.types.is_binary(field.type)
        arrays.append(pa.array([_json(value) for value in column.to_pylist()], pa.string()) if nested else column)
    pc.write_csv(pa.table(arrays, names=names), path)


def _json(value: Any) -> str | None:
    if value is None:
        return None
    return value.hex() if isinstance(value, bytes) else json.dumps(value)


_WRITERS: Mapping[str, Callable[["pa.Table", Path], None]] = {".parquet": _parquet, ".csv": _csv}
