"""gpsd reads the position and heading ports: fixes of mode 3 with the values of the track.

HIL_SECONDS=60 runs the bar of the project: 60 s at 10 sentences a second.
"""

import csv
import json
import os
import shutil
import socket
import subprocess
import time
from datetime import datetime

import pytest
from support.hil_host import Hil

GPSD = shutil.which("gpsd") or shutil.which("gpsd", path="/usr/sbin:/usr/local/sbin")
SECONDS = float(os.environ.get("HIL_SECONDS", "6"))
SHARE = 0.99


def free_port():
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


def reports(port, seconds):
    """Objects that gpsd sends within a time, once both devices have told something."""
    end = time.monotonic() + 20.0
    while True:
        try:
            talk = socket.create_connection(("127.0.0.1", port), 1.0)
            break
        except OSError:
            assert time.monotonic() < end, "gpsd does not listen"
            time.sleep(0.1)
    with talk, talk.makefile("r") as lines:
        talk.sendall(b'?WATCH={"enable":true,"json":true}\n')
        talk.settimeout(10.0)
        kinds, found = set(), []
        while not {"TPV", "ATT"} <= kinds and time.monotonic() < end:
            one = json.loads(lines.readline())
            kinds |= {one["class"]} if one.get("mode", 3) == 3 else set()
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            found.append(json.loads(lines.readline()))
    return found


@pytest.mark.skipif(GPSD is None, reason="gpsd is not installed: apt-get install gpsd")
def test_gpsd_has_fixes_and_headings_with_the_values_of_the_track(tmp_path):
    port = free_port()
    with Hil(tmp_path, "--duration", str(SECONDS + 30.0)) as hil:
        call = [GPSD, "-N", "-n", "-S", str(port), hil.ports["position"], hil.ports["heading"]]
        gpsd = subprocess.Popen(call, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            found = reports(port, SECONDS)
        finally:
            gpsd.kill()
            gpsd.wait()
        code, _, numbers = hil.end()
    assert code == 0
    with (hil.out / "track.csv").open() as file:
        track = {row["utc"][:22]: row for row in csv.DictReader(file)}
    fixes = [one for one in found if one["class"] == "TPV" and one["device"] == hil.ports["position"]]
    right = [one for one in fixes if is_right(one, track.get(one.get("time", "")[:22]))]
    headings = [one["heading"] for one in found if one["class"] == "ATT" and "heading" in one]
    print(f"{len(fixes)} fixes, {len(right)} right, {len(headings)} headings in {SECONDS:g} s; {numbers['scans']}")
    first, last = (datetime.fromisoformat(fixes[k]["time"]) for k in (0, -1))
    due = round(10.0 * (last - first).total_seconds()) + 1
    # A pause of the machine leaves sentences out: not missing, where the session itself says so.
    due -= numbers["sentences"]["missed"]
    # Of two sentences that a pause brought together gpsd may tell one.
    due -= int(numbers["scans"]["behind_most"] > 0)
    # What gpsd had not yet told when the time was over is not missing.
    assert due > 5.0 * SECONDS and len(headings) > SHARE * due - 10
    assert len(fixes) - len(right) <= 1 and len(right) >= SHARE * due
    wanted = [float(row["heading_deg"]) for row in track.values()]
    assert min(wanted) - 1e-3 <= min(headings) and max(headings) <= max(wanted) + 1e-3


def is_right(fix, row):
    """Whether a fix has mode 3 and place, height, speed and course of the track at its time."""
    if row is None or fix["mode"] != 3:
        return False
    place = abs(fix["lat"] - float(row["latitude_deg"])) < 2e-8 and abs(fix["lon"] - float(row["longitude_deg"])) < 2e-8
    return place and abs(fix["speed"] - float(row["speed_mps"])) < 0.01
