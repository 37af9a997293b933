"""Hardware in the loop for minutes: `raychan hil` in real time, with a reader that is killed and started again.

PYTHONPATH=tests python -m hil_run --seconds 300 --baud 38400

Prints drift, jitter and drops, and the load of the machine beside them. Exit code 1 where a bar is not met: drift of
10 ms, jitter of 5 ms (99th percentile), a frame that is neither sent nor counted, a reader that gets nothing once it is
back. The bars are meant for an idle machine.
"""

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from support.hil_host import Hil, LmsHost

DRIFT_MS, JITTER_MS = 10.0, 5.0


def read_for_ever(name):
    """Read scans until killed; print their number and that of damaged ones, a line a second."""
    host, read = LmsHost(name), 0
    while True:
        read += len(host.scans(1.0))
        print(read, host.bad, flush=True)


class Reader:
    """A reader in a process of its own."""

    def __init__(self, port):
        call = [sys.executable, "-m", "hil_run", "--reader", port]
        self.process = subprocess.Popen(call, stdout=subprocess.PIPE, text=True)

    def kill(self):
        """Kill it as a crash would; return how many scans it had said to have read, and how many were damaged."""
        self.process.send_signal(signal.SIGKILL)
        lines = self.process.communicate()[0].splitlines()
        return tuple(map(int, lines[-1].split())) if lines else (0, 0)


def watch(hil, seconds, lives):
    """Kill and restart a reader so many times; return a row (scans read, damaged) for each life."""
    found = []
    for _ in range(lives):
        reader = Reader(hil.ports["scanner"])
        time.sleep(max(2.0, seconds / lives - 1.0))
        found.append(reader.kill())
        time.sleep(1.0)
    return found


def main():
    """Run, print, and return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=300.0)
    parser.add_argument("--baud", type=int, default=38400)
    parser.add_argument("--lives", type=int, default=4, help="how often the reader is started")
    parser.add_argument("--no-realtime", action="store_true", help="as of raychan hil")
    parser.add_argument("--reader", help=argparse.SUPPRESS)
    wanted = parser.parse_args()
    if wanted.reader:
        read_for_ever(wanted.reader)
    with tempfile.TemporaryDirectory() as folder:
        options = ("--baud", str(wanted.baud), "--stream", "--duration", str(wanted.seconds))
        if wanted.no_realtime:
            options += ("--no-realtime",)
        with Hil(Path(folder), *options) as hil:
            before = os.getloadavg()[0]
            lives = watch(hil, wanted.seconds, wanted.lives)
            code, _, numbers = hil.end(None)
    return report(wanted, numbers, lives, (before, os.getloadavg()[0])) or code


def report(wanted, numbers, lives, load):
    """Print what was found; return 1 where a bar is not met."""
    parts = ("sent", "busy", "no_peer", "not_reading", "unfinished")
    uncounted = sum(c["made"] - sum(c[p] for p in parts) for c in numbers["channels"].values())
    scanner = numbers["channels"]["scanner"]
    print(f"{wanted.seconds:g} s at {wanted.baud} baud; load {load[0]:.1f} before, {load[1]:.1f} after")
    print(
        f"scans a second: {scanner['sent'] / numbers['seconds']:.2f} sent of {scanner['made'] / numbers['seconds']:.2f}"
    )
    print(json.dumps({**numbers["scans"], **{k: scanner[k] for k in (*parts, "made", "drift_ms", "jitter_p99_ms")}}))
    print(f"readers (scans, damaged): {lives}; reconnects {scanner['reconnects']}; uncounted {uncounted}")
    drift = max(abs(numbers["scans"]["drift_ms"]), abs(scanner["drift_ms"]))
    jitter = max(numbers["scans"]["jitter_p99_ms"], scanner["jitter_p99_ms"])
    met = drift <= DRIFT_MS and jitter < JITTER_MS and not uncounted and all(read and not bad for read, bad in lives)
    print(f"drift {drift:.3f} ms, jitter {jitter:.3f} ms: {'met' if met else 'NOT met'}")
    return int(not met)


if __name__ == "__main__":
    sys.exit(main())
