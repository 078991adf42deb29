"""Errors as channels of the log: ``/error/{name}/attitude``."""

from collections.abc import Mapping

from ..schemas.columns import Channel, Columns
from ..schemas.messages import ATTITUDE_ERROR
from ..schemas.unified import WORLD, table
from .alignment import Alignment, ConstantRotation
from .error import AttitudeError
from .summary import COMPONENTS


def error_columns(
    error: AttitudeError,
    *,
    name: str | None = None,
    prefix: str = "",
    metadata: Mapping[str, str] | None = None,
) -> Columns:
    """attlog_msgs/msg/AttitudeError on ``{prefix}/error/{name}/attitude``, degrees, one message per estimate's sample.

    ``name`` is the estimate's unless given (``onboard_att``). The metadata say against what, by topic and content hash,
    and what was removed. Without a reference the errors are NaN.
    """
    topic = f"{prefix}/error/{name or error.estimate.name}/attitude"
    degrees = {f"{component}_deg": error[component] for component in COMPONENTS}
    data = table(ATTITUDE_ERROR, {**degrees, "counted": error.euler_counted})
    about = {
        "estimate": error.estimate.topic,
        "reference": error.reference.topic,
        "reference_sha256": error.reference.sha256,
        "north": error.estimate.metadata.get("north", "true"),
        **alignment_metadata(error.options.alignment, error.removed),
        **_spans(error),
        **(metadata or {}),
    }
    return Columns(Channel(topic, ATTITUDE_ERROR, about, {"header.frame_id": WORLD}), error.time_ns, data)


def alignment_metadata(kind: Alignment, removed: ConstantRotation) -> dict[str, str]:
    """What was removed before counting, as text: a heading in degrees, or two rotation vectors in degrees."""
    about = {"alignment": str(kind)}
    if kind is Alignment.YAW:
        about["removed_heading_deg"] = f"{removed.heading_deg:.6g}"
    if kind is Alignment.FULL:
        about["removed_world_deg"] = " ".join(f"{angle:.6g}" for angle in removed.world_deg)
        about["removed_body_deg"] = " ".join(f"{angle:.6g}" for angle in removed.body_deg)
    return about


def _spans(error: AttitudeError) -> dict[str, str]:
    options = error.options
    spans = {"start_ns": options.start_ns, "end_ns": options.end_ns}
    about = {name: str(value) for name, value in spans.items() if value is not None}
    if options.exclude:
        about["excluded_ns"] = " ".join(f"{start}:{end}" for start, end in options.exclude)
    return about
