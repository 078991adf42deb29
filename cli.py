"""The command line: one thin function for each verb, which is one call of the package."""

import logging
import os
import sys
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import click

if TYPE_CHECKING:
    from .pipeline.outcomes import Outcomes

F = TypeVar("F", bound=Callable[..., Any])

EXIT_NOTHING = 1
EXIT_USAGE = 2
EXIT_PARTIAL = 3
EXIT_INTERRUPTED = 130


def _options(*decorators: Callable[[F], F]) -> Callable[[F], F]:
    def apply(function: F) -> F:
        for decorator in reversed(decorators):
            function = decorator(function)
        return function

    return apply


LOGS = click.argument("logs", nargs=-1, required=True, metavar="LOG...")
OUTPUT = click.option("-o", "--output", help="File to write, or folder (always a folder for several logs).")
FORCE = click.option("--force", is_flag=True, help="Replace an output that exists.")
JOBS = click.option("-j", "--jobs", type=click.IntRange(1), help="Logs handled at once.  [default: all cores]")
TIMEOUT = click.option(
    "--timeout", type=click.FloatRange(min=0.1), default=3600.0, help="Seconds for one log of several."
)
JSON = click.option("--json", "as_json", is_flag=True, help="Print JSON instead of text.")
COMMON = _options(OUTPUT, FORCE, JOBS, TIMEOUT, JSON)
SOURCE = _options(
    click.option("--vehicle", help="System id whose topics get no prefix, or 'all' to prefix every vehicle's."),
    click.option(
        "--sensor", help="What raw counts mean: mpu9250, or LSB/g, LSB/(deg/s), uT/LSB: accel=16384,gyro=131,mag=0.15"
    ),
    click.option("--dialect", default="ardupilotmega", show_default=True, help="MAVLink dialect."),
    click.option("--columns", metavar="NAME,...", help="CSV: what the columns are, as in t_us,ax_g,ay_g,az_g,gx_dps,…"),
    click.option("--rate", type=float, metavar="HZ", help="CSV: fixed rate, in place of a column of times."),
    click.option("--time-unit", type=click.Choice(["s", "ms", "us", "ns"]), help="CSV: unit of the times."),
    click.option("--profile", metavar="TOML", help="CSV: profile with columns, units, clock, sensor, attitude."),
    click.option("--strict", is_flag=True, help="CSV: refuse to guess what neither header nor options say."),
    click.option("--normalize", is_flag=True, help="CSV: take quaternions that are not of unit norm."),
    click.option("--compression", type=click.Choice(["zstd", "lz4", "none"]), default="zstd", show_default=True),
)
TOPICS = click.option(
    "--topic",
    "topics",
    multiple=True,
    metavar="ROLE=TOPIC",
    help="What another program's channel is, as in imu=/phone/imu, mag=…, reference=/vicon/pose, onboard_odom=/odom.",
)
ESTIMATE = _options(
    click.option(
        "-e",
        "--estimator",
        "estimators",
        multiple=True,
        metavar="NAME[:KEY=VALUE,...]",
        help="Estimator, as in ecf:imu=1,kp=0.5,as=soft; several times.  [default: ecf, ekf9 or ekf6, gyro]",
    ),
    click.option("--declination", type=float, help="Degrees, east positive; overrides what the log knows."),
    TOPICS,
)
ANALYZE = _options(
    click.option(
        "--reference",
        help="Compare with truth, onboard, an attitude's name, or another MCAP.  [default: truth, else onboard]",
    ),
    click.option(
        "--align",
        "alignment",
        type=click.Choice(["none", "yaw", "full"]),
        help="Constant rotation to remove first.  [default: none; yaw where north is arbitrary]",
    ),
    click.option("--start", type=float, help="Seconds from the log's start; earlier samples do not count."),
    click.option("--end", type=float, help="Seconds from the log's start; later samples do not count."),
    click.option("--exclude", multiple=True, metavar="FROM:TO", help="Seconds that do not count; several times."),
)


def _say(verbose: int, quiet: bool) -> None:
    """How much goes to stderr."""
    if verbose or quiet:
        logging.getLogger().setLevel(logging.ERROR if quiet else (logging.INFO, logging.DEBUG)[min(verbose, 2) - 1])


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(package_name="attlog")
@click.option("-v", "--verbose", count=True, help="Say more on stderr (-vv: tracebacks).")
@click.option("-q", "--quiet", is_flag=True, help="Say nothing on stderr but errors.")
def cli(verbose: int, quiet: bool) -> None:
    """Turn flight and IMU logs into one reviewable MCAP, estimate the attitude, and tell how wrong each estimate is.

    Every verb takes files, folders, globs and - (stdin); one bad log stops no other. Exit codes: 0 done, 1 nothing
    could be done, 2 wrong usage, 3 done but for bytes that were skipped or logs that failed, 130 interrupted.
    """
    logging.basicConfig(format="%(message)s", stream=sys.stderr)
    _say(verbose, quiet)


@cli.command()
@LOGS
@COMMON
@SOURCE
def convert(logs: Sequence[str], jobs: int | None, timeout: float, as_json: bool, **options: Any) -> None:
    """Turn logs of any format into MCAPs."""
    from . import pipeline

    options = _with_csv(options) | {"vehicle": _vehicle(options["vehicle"])}
    _show(_each(pipeline.convert, logs, jobs=jobs, timeout_s=timeout, **options), as_json)


@cli.command()
@LOGS
@COMMON
@ESTIMATE
def estimate(
    logs: Sequence[str], jobs: int | None, timeout: float, as_json: bool, estimators: Sequence[str], **options: Any
) -> None:
    """Add attitude estimates to MCAPs."""
    from . import pipeline

    chosen = list(estimators) or None
    _show(_each(pipeline.estimate, logs, chosen, jobs=jobs, timeout_s=timeout, **options), as_json)


@cli.command()
@LOGS
@COMMON
@ANALYZE
@TOPICS
@click.option("--parquet", help="Also write the table to this Parquet file.")
def analyze(
    logs: Sequence[str],
    jobs: int | None,
    timeout: float,
    as_json: bool,
    exclude: Sequence[str],
    parquet: str | None,
    force: bool,
    **options: Any,
) -> None:
    """Compare every attitude of MCAPs with a reference."""
    from . import pipeline
    from .analysis.table import ErrorTable

    spans = [_span(text) for text in exclude]
    options |= {"exclude": spans, "force": force}
    done = _each(pipeline.analyze, logs, jobs=jobs, timeout_s=timeout, **options)
    if parquet is not None and done.results:
        ErrorTable.joined(result.table for result in done.results).to_parquet(parquet, force=force)
    _show(done, as_json)


@cli.command()
@LOGS
@COMMON
@SOURCE
@ESTIMATE
@ANALYZE
def run(
    logs: Sequence[str],
    jobs: int | None,
    timeout: float,
    as_json: bool,
    estimators: Sequence[str],
    exclude: Sequence[str],
    **options: Any,
) -> None:
    """Convert, estimate and analyze in one go."""
    from . import pipeline

    options = _with_csv(options) | {"vehicle": _vehicle(options["vehicle"])}
    options |= {"estimators": list(estimators) or None, "exclude": [_span(text) for text in exclude]}
    _show(_each(pipeline.run, logs, jobs=jobs, timeout_s=timeout, **options), as_json)


@cli.command()
@LOGS
@JOBS
@TIMEOUT
@JSON
def info(logs: Sequence[str], jobs: int | None, timeout: float, as_json: bool) -> None:
    """Tell what is in MCAPs: topics, types, counts, rates, time span, source, completeness."""
    from . import pipeline

    _show(_each(pipeline.info, logs, jobs=jobs or 1, timeout_s=timeout), as_json)


@cli.command()
@click.argument("logs", nargs=-1, required=True, metavar="LOG... [TEXT]")
@COMMON
@click.option("--at", help="When: 12.3s or 1m5s after the log's start, or a date such as 2015-06-11T12:13:14Z.")
@click.option("--to", help="Until when, written as --at.")
@click.option("--severity", default="info", show_default=True, help="debug, info, warn, error or fatal.")
@click.option("--notes", help="CSV of notes with the columns at,to,severity,text.")
@click.option("--remove", multiple=True, type=int, metavar="N", help="Take out note N as listed; several times.")
@click.option("--list", "list_only", is_flag=True, help="Only list the notes (with numbers).")
def annotate(
    logs: Sequence[str],
    at: str | None,
    jobs: int | None,
    timeout: float,
    as_json: bool,
    list_only: bool,
    **options: Any,
) -> None:
    """Add a person's notes to MCAPs, list them, or take them out.

    With --at, the last argument is the note's text: attlog annotate flight.mcap --at 12.3s "compass swings here".
    """
    from . import pipeline

    files, text = (list(logs), None) if at is None else (list(logs[:-1]), logs[-1])
    if text is not None and os.path.exists(text):
        raise click.UsageError(f"{text} is a file: the last argument is the note's text")
    if not files:
        raise click.UsageError('a note needs a log and a text: attlog annotate FILE --at 12.3s "text"')
    if list_only and (at is not None or options["notes"] or options["remove"]):
        raise click.UsageError("--list goes without --at, --notes and --remove")
    _show(_each(pipeline.annotate, files, text, at=at, jobs=jobs, timeout_s=timeout, **options), as_json)


@cli.command()
@LOGS
@COMMON
@click.option(
    "--reference",
    help="Whose clock: truth, onboard, an attitude's name, or another MCAP.  [default: truth, else onboard]",
)
@click.option("--imu", type=click.IntRange(0), help="The gyro to align with.  [default: the first]")
@click.option("--drift/--no-drift", default=True, show_default=True, help="Whether one clock may run faster.")
@TOPICS
def align(
    logs: Sequence[str], jobs: int | None, timeout: float, as_json: bool, reference: str | None, **options: Any
) -> None:
    """Find and store how a reference's clock differs from the gyro's, in MCAPs."""
    from . import pipeline

    _show(_each(pipeline.align, logs, reference, jobs=jobs, timeout_s=timeout, **options), as_json)


@cli.command()
@LOGS
@click.option("-o", "--output", help="Folder to write to; several logs get one each in it.  [default: beside the log]")
@FORCE
@JOBS
@TIMEOUT
@JSON
@click.option("--format", type=click.Choice(["parquet", "csv"]), default="parquet", show_default=True)
@click.option("--topic", "topics", multiple=True, metavar="GLOB", help="Only these topics; several times.")
@click.option("--start", type=float, help="Seconds from the log's start.")
@click.option("--end", type=float, help="Seconds from the log's start.")
@click.option("--resample", metavar="TOPIC", help="Put every channel on this one's clock.")
def export(logs: Sequence[str], jobs: int | None, timeout: float, as_json: bool, **options: Any) -> None:
    """Write each channel of MCAPs to a Parquet or CSV file of its own."""
    from . import pipeline

    _show(_each(pipeline.export, logs, jobs=jobs, timeout_s=timeout, **options), as_json)


@cli.command()
@click.argument("scenario")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True)
@click.option("-o", "--output", required=True, help="File to write: .tlog or .mcap.")
@FORCE
@JSON
def simulate(scenario: str, seed: int, output: str, force: bool, as_json: bool) -> None:
    """Fly a seeded simulation and log it, with truth (attlog list scenarios names them)."""
    from . import pipeline

    _print(pipeline.simulate(scenario, output, seed=seed, force=force), as_json)


@cli.command()
@click.argument("source")
@click.option("-o", "--output", required=True, help="File to write (.mcap).")
@click.option("--duration", metavar="TIME", help="Stop after 90s, 10min, 2h, ….  [default: at Ctrl-C or SIGTERM]")
@click.option("--rotate-size", metavar="SIZE", help="Begin a new file after 100MB, 1GiB, … have arrived.")
@click.option("--rotate-time", metavar="TIME", help="Begin a new file after 10min, 1h, ….")
@click.option("--keep-stream/--drop-stream", default=True, show_default=True, help="Keep the bytes as they arrived.")
@FORCE
@JSON
@SOURCE
@click.pass_context
def record(
    context: click.Context,
    /,
    source: str,
    output: str,
    duration: str | None,
    rotate_size: str | None,
    rotate_time: str | None,
    as_json: bool,
    **options: Any,
) -> None:
    """Record a serial port or a MAVLink link until Ctrl-C.

    SOURCE is serial:/dev/ttyUSB0:115200 (lines of CSV), mavlink:udpin:0.0.0.0:14550, mavlink:tcp:HOST:PORT,
    mavlink:tcpin:0.0.0.0:PORT or mavlink:serial:/dev/ttyACM0:57600. With rotation the files are FILE_0001.mcap, ….
    """
    from . import pipeline
    from .pipeline.amounts import bytes_of, seconds_of
    from .pipeline.terminal import StatusLine, stopping

    options = _with_csv(options) | {"vehicle": _vehicle(options["vehicle"])}
    options |= {"duration_s": duration and seconds_of(duration), "rotate_s": rotate_time and seconds_of(rotate_time)}
    options |= {"rotate_bytes": rotate_size and bytes_of(rotate_size)}
    line = StatusLine(not context.find_root().params["quiet"])
    with stopping() as stop:
        done = pipeline.record(source, output, stop=stop, watch=lambda now: line.show(now.to_text()), **options)
        line.end()
    if not done.files:
        click.echo(f"attlog: {source}: nothing arrived; nothing was written", err=True)
        sys.exit(EXIT_INTERRUPTED if stop.asked else EXIT_NOTHING)
    _print(done, as_json)
    sys.exit(0 if done.complete else EXIT_PARTIAL)


@cli.command()
@LOGS
@COMMON
@SOURCE
def recover(logs: Sequence[str], jobs: int | None, timeout: float, as_json: bool, **options: Any) -> None:
    """Make whole MCAPs of ones that were cut off, killed or damaged (FILE.recovered.mcap beside each).

    Of a recording that was killed, the stream becomes channels as at its end; the options say what it is.
    """
    from . import pipeline

    options = _with_csv(options) | {"vehicle": _vehicle(options["vehicle"])}
    del options["compression"]
    _show(_each(pipeline.recover, logs, jobs=jobs, timeout_s=timeout, **options), as_json)


@cli.command(name="list")
@click.argument("what", type=click.Choice(["estimators", "formats", "scenarios"]))
@JSON
def list_(what: str, as_json: bool) -> None:
    """List what there is to choose from."""
    from .pipeline.listing import listing

    _print(listing(what), as_json)


def _each(call: Any, logs: Sequence[str], *args: Any, **options: Any) -> "Outcomes[Any]":
    """Do every log, with a bar on a terminal unless it is to be quiet."""
    from . import pipeline
    from .pipeline.progress import bar

    options["jobs"] = options.get("jobs") or os.cpu_count() or 1
    quiet = logging.getLogger().getEffectiveLevel() >= logging.ERROR
    return pipeline.for_each(call, logs, *args, progress=None if quiet else bar, **options)


def _vehicle(spelled: str | None) -> Any:
    if spelled is None or spelled == "all":
        return spelled
    if not spelled.isdigit():
        raise click.UsageError(f"--vehicle takes a system id or 'all', not {spelled!r}")
    return int(spelled)


def _with_csv(options: dict[str, Any]) -> dict[str, Any]:
    """The options with those for a CSV put together as ``csv``."""
    from .ingest.serial_csv import csv_options

    columns, profile = options.pop("columns"), options.pop("profile")
    said = {
        "columns": tuple(name.strip() for name in columns.split(",")) if columns else None,
        "rate_hz": options.pop("rate"),
        "time_unit": options.pop("time_unit"),
        "strict": options.pop("strict") or None,
        "normalize": options.pop("normalize") or None,
    }
    return options | {"csv": csv_options(profile, **said)}


def _span(spelled: str) -> tuple[float, float]:
    try:
        first, last = (float(part.rstrip("s")) for part in spelled.split(":"))
    except ValueError:
        raise click.UsageError(f"--exclude takes FROM:TO in seconds, such as 12.5:20, not {spelled!r}") from None
    return first, last


def _print(result: Any, as_json: bool) -> None:
    from .pipeline.outcomes import as_json as json_of

    click.echo(json_of(result.to_dict()) if as_json else result.to_text())


def _show(outcomes: "Outcomes[Any]", as_json: bool) -> None:
    for line in outcomes.errors:
        click.echo(f"attlog: {line}", err=True)
    if not outcomes:
        click.echo("attlog: no log found in what was named", err=True)
    if as_json:
        _say_result(outcomes.to_json())
    elif outcomes.results:
        _say_result(outcomes.to_text())
    sys.exit(outcomes.exit_code)


def _say_result(text: str) -> None:
    """Print; a reader that has gone away changes nothing of what was done."""
    try:
        click.echo(text)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def main() -> None:
    """The program ``attlog``: errors as one line on stderr, and the exit code."""
    try:
        cli.main(standalone_mode=False)
    except (click.exceptions.Abort, KeyboardInterrupt):
        sys.exit(EXIT_INTERRUPTED)
    except click.ClickException as error:
        error.show()
        sys.exit(EXIT_USAGE)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(EXIT_NOTHING)
    except Exception as error:
        sys.exit(_failed(error))


def _failed(error: Exception) -> int:
    """Say the error in one line; the exit code."""
    from .pipeline.batch import describe
    from .schemas.errors import UsageError

    click.echo(f"attlog: {describe('attlog', error)}", err=True)
    return EXIT_USAGE if isinstance(error, UsageError) else EXIT_NOTHING
