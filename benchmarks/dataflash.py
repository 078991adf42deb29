"""DataFlash to columns against pymavlink's recv_msg, and the long log that ``attlog run`` is measured on.

``python -m benchmarks.dataflash`` prints the CPU time of reading that long log, too.
"""

import os
import struct
import tempfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .row import Row, cpu_seconds

RECORDS = 500_000
TARGET = 75.0
COPIES = 12
REAL_LOG = (
    Path(os.environ.get("ATTLOG_SHARED", Path(__file__).parents[2] / "shared")) / "data/logs/plane_crash_3imu.bin"
)

Bytes = NDArray[np.uint8]

FORMATS = (
    (130, "IMU", "QBffffffIIfBBHH", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,EG,EA,T,GH,AH,GHz,AHz", 6),
    (131, "ATT", "QccccCCB", "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw,AEKF", 1),
    (132, "XKQ", "QBffff", "TimeUS,C,Q1,Q2,Q3,Q4", 2),
    (133, "RATE", "Qffffffffffff", "TimeUS,RDes,R,ROut,PDes,P,POut,YDes,Y,YOut,ADes,A,AOut", 1),
    (134, "BARO", "QBffcfIffB", "TimeUS,I,Alt,Press,Temp,CRt,SMS,Offset,GndTemp,Health", 2),
    (135, "MAG", "QBhhhhhhhhhBI", "TimeUS,I,MagX,MagY,MagZ,OfsX,OfsY,OfsZ,MOX,MOY,MOZ,Health,S", 2),
    (136, "RCOU", "QHHHHHHHHHHHHHH", "TimeUS,C1,C2,C3,C4,C5,C6,C7,C8,C9,C10,C11,C12,C13,C14", 1),
    (137, "RCIN", "QHHHHHHHHHHHHHH", "TimeUS,C1,C2,C3,C4,C5,C6,C7,C8,C9,C10,C11,C12,C13,C14", 1),
    (138, "XKF1", "QBccCfffffffccce", "TimeUS,C,Roll,Pitch,Yaw,VN,VE,VD,dPD,PN,PE,PD,GX,GY,GZ,OH", 2),
    (139, "XKF2", "QBccccchhhhhhfff", "TimeUS,C,AX,AY,AZ,VWN,VWE,MN,ME,MD,MX,MY,MZ,IDX,IDY,IS", 2),
    (140, "XKF3", "QBcccccchhhccff", "TimeUS,C,IVN,IVE,IVD,IPN,IPE,IPD,IMX,IMY,IMZ,IYAW,IVT,RErr,ErSc", 2),
    (141, "XKF4", "QBcccccfffHBIHB", "TimeUS,C,SV,SP,SH,SM,SVT,errRP,OFN,OFE,FS,TS,SS,GPS,PI", 2),
    (142, "VIBE", "QBfffI", "TimeUS,IMU,VibeX,VibeY,VibeZ,Clip", 2),
    (143, "CTUN", "Qffffffefffhh", "TimeUS,ThI,ABst,ThO,ThH,DAlt,Alt,BAlt,DSAlt,SAlt,TAlt,DCRt,CRt", 1),
    (144, "POS", "QLLfff", "TimeUS,Lat,Lng,Alt,RelHomeAlt,RelOriginAlt", 1),
)
"""Type number, name, format, columns, records per round: in the proportions of copter_sitl_truth.BIN."""
ROUND_US = 100_000
INSTANCES = {"I": 2, "C": 2, "IMU": 2}
NUMPY = {
    "B": "u1",
    "h": "<i2",
    "H": "<u2",
    "i": "<i4",
    "I": "<u4",
    "Q": "<u8",
    "f": "<f4",
    "N": "S16",
    "c": "<i2",
    "C": "<u2",
    "e": "<i4",
    "L": "<i4",
}


def rows() -> Iterator[Row]:
    """One row: 500,000 records."""
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "synthetic.bin"
        log.write_bytes(synthetic(RECORDS))
        read(log)  # compiles the kernels
        ratio = cpu_seconds(partial(iterate, log), 1) / cpu_seconds(partial(read, log), 5)
        yield Row("DataFlash to columns, 500 k records", "pymavlink recv_msg", ratio, TARGET)


def read(path: Path) -> object:
    """What attlog does: the file to columns."""
    from attlog.ingest import dataflash
    from attlog.schemas import Source

    return dataflash.read(Source.from_path(path))


def iterate(path: Path) -> int:
    """What the peer does: every message once, no field looked at; their number."""
    from pymavlink import DFReader

    count = 0
    with DFReader.DFReader_binary(str(path)) as log:
        while log.recv_msg() is not None:
            count += 1
    return count


def synthetic(records: int) -> bytes:
    """A log of ``records`` records of the types above, a round of them every 100 ms."""
    rng = np.random.default_rng(1)
    head = b"".join(
        _definition(*entry[:4]) for entry in ((128, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns", 0), *FORMATS)
    )
    rounds = -(-records // sum(entry[4] for entry in FORMATS))
    parts = []
    for number, _, characters, columns, count in FORMATS:
        names = columns.split(",")
        dtype = np.dtype([("head", "3u1"), *((n, NUMPY[c]) for n, c in zip(names, characters, strict=True))])
        table = np.frombuffer(rng.bytes(rounds * count * dtype.itemsize), dtype).reshape(rounds, count).copy()
        table["head"] = (0xA3, 0x95, number)
        table["TimeUS"] = (
            10_000_000 + ROUND_US * np.arange(rounds)[:, np.newaxis] + ROUND_US // count * np.arange(count)
        )
        for name in names:
            if table.dtype[name].kind == "f":
                table[name] = rng.standard_normal(table.shape)
            elif name in INSTANCES:
                table[name] = np.arange(count) % INSTANCES[name]
        parts.append(table.view(np.uint8).reshape(rounds, -1))
    return head + _units() + np.concatenate(parts, axis=1).tobytes()


def _units() -> bytes:
    """What every log since 2018 says of its columns; of interest here: which one is the instance."""
    head = _definition(120, "FMTU", "QBNN", "TimeUS,FmtType,UnitIds,MultIds")
    for number, _, characters, columns, _ in FORMATS:
        units = "".join("#" if name in INSTANCES else "s" if name == "TimeUS" else "-" for name in columns.split(","))
        values = (0xA3, 0x95, 120, 10_000_000, number, units.encode(), b"F".ljust(len(characters), b"-"))
        head += struct.pack("<BBBQB16s16s", *values)
    return head


def _definition(number: int, name: str, characters: str, columns: str) -> bytes:
    sizes = {"n": 4, "N": 16, "Z": 64}
    length = 3 + sum(sizes.get(c, 0) or np.dtype(NUMPY[c]).itemsize for c in characters)
    return struct.pack(
        "<BBBBB4s16s64s", 0xA3, 0x95, 0x80, number, length, name.encode(), characters.encode(), columns.encode()
    )


def long_flight(path: Path, copies: int = COPIES) -> bool:
    """Write plane_crash_3imu.bin ``copies`` times over to ``path``, each time later by the log's length (40 MB).

    Every record's TimeUS moves on, and so do GPS time and the samples' own times. False where the log is not there.
    """
    if not REAL_LOG.is_file():
        return False
    original = np.fromfile(REAL_LOG, np.uint8)
    fields = list(_time_fields(original))
    times = _field(original, fields[0][0], 8)
    period_us = (int(times.max() - times.min()) // 1_000_000 + 1) * 1_000_000
    with path.open("wb") as file:
        for copy in range(copies):
            moved = original.copy()
            for places, size, unit_us in fields:
                _set_field(moved, places, size, _field(original, places, size) + copy * period_us // unit_us)
            file.write(moved.tobytes())
    return True


SAMPLE_TIMES = {"GPS": ("GMS", 1000), "GPA": ("SMS", 1000), "BARO": ("SMS", 1000), "MAG": ("S", 1)}
"""Type -> column with a time of its own, and its unit in us."""


def _time_fields(log: Bytes) -> Iterator[tuple[NDArray[np.int64], int, int]]:
    """Places of the log's time fields, their size, their unit in us; TimeUS of all types first."""
    from pymavlink import DFReader

    with DFReader.DFReader_binary(str(REAL_LOG)) as reader:
        found = [(reader.formats[kind], np.array(reader.offsets[kind])) for kind in range(256) if reader.counts[kind]]
    timed = [offsets for form, offsets in found if form.columns[0] == "TimeUS"]
    yield np.concatenate(timed) + 3, 8, 1
    for form, offsets in found:
        column, unit = SAMPLE_TIMES.get(form.name, ("", 0))
        if column:
            before = form.columns.index(column)
            offset = struct.calcsize("<" + "".join(DFReader.FORMAT_TO_STRUCT[c][0] for c in form.format[:before]))
            yield offsets + 3 + offset, 4, unit


def _field(log: Bytes, places: NDArray[np.int64], size: int) -> NDArray[np.int64]:
    stored = log[places[:, np.newaxis] + np.arange(size)]
    return stored.view(f"<u{size}")[:, 0].astype(np.int64)


def _set_field(log: Bytes, places: NDArray[np.int64], size: int, values: NDArray[np.int64]) -> None:
    log[places[:, np.newaxis] + np.arange(size)] = values.astype(f"<u{size}")[:, np.newaxis].view(np.uint8)


def main() -> None:
    """Print the row, and the long log's CPU times."""
    for row in rows():
        print(f"{row.work}: {row.ratio:.1f} x {row.peer} (at least {row.target:g})")
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "long.bin"
        if long_flight(log):
            ours, peer = cpu_seconds(partial(read, log), 3), cpu_seconds(partial(iterate, log), 1)
            print(
                f"{log.stat().st_size / 1e6:.1f} MB BIN to columns: {ours:.3f} s CPU, pymavlink iterating: {peer:.2f} s"
            )


if __name__ == "__main__":
    main()
