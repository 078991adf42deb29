"""Run the benchmarks that are named (all by default) and print a row for each: work, peer, ratio, target."""

import sys
from importlib import import_module

NAMES = ("storage", "mavlink", "dataflash", "ulog", "serial_csv", "estimators", "run")


def main(names: list[str]) -> int:
    """1 where a target is missed."""
    print(f"{'work':<62} {'peer':<44} {'ratio':>8} {'target':>8}")
    missed = 0
    for name in names or NAMES:
        for row in import_module(f".{name}", __package__).rows():
            mark = "" if row.met else "  MISSED"
            print(f"{row.work:<62} {row.peer:<44} {row.ratio:>8.2f} {row.target:>8.2f}{mark}", flush=True)
            missed += not row.met
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
