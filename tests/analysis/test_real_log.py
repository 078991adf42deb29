"""A simulator's log with its truth, read by pymavlink: the autopilot's own error, as others have measured it."""

import numpy as np
import pytest

from attlog.analysis import attitude_error
from attlog.geometry.frames import orientation_from_rpy_ned
from attlog.schemas import Attitude


def read(path, kind):
    from pymavlink import mavutil

    log = mavutil.mavlink_connection(str(path))
    rows = []
    while (message := log.recv_match(type=kind)) is not None:
        rows.append((message.TimeUS, message.Roll, message.Pitch, message.Yaw))
    table = np.array(rows)
    orientation = orientation_from_rpy_ned(np.radians(table[:, 1:]))
    return Attitude(table[:, 0].astype(np.int64) * 1000, orientation, kind.lower(), f"/{kind.lower()}/attitude")


def test_att_against_sim_as_logged(logs):
    log = logs / "copter_sitl_truth.BIN"
    error = attitude_error(read(log, "ATT"), read(log, "SIM"))
    assert error.counts.samples == 1997
    rmse = {name: error.statistics[name].rmse for name in ("roll", "pitch", "yaw")}
    assert rmse["roll"] == pytest.approx(0.12, abs=0.005)
    assert rmse["pitch"] == pytest.approx(0.10, abs=0.005)
    assert 3.335 <= rmse["yaw"] <= 3.355
