"""A session keeps the ship's time: what it sends, what it owes where the loop is slow, what a new fan does."""

import os
import time
import tomllib
from itertools import pairwise

import numpy as np
import pytest
from support.hil_host import SCENE, command

from raychan.hil.channel import Channel
from raychan.hil.geodesy import Origin
from raychan.hil.instruments import ScannedShip
from raychan.hil.orders import order_sentence
from raychan.hil.scans import decode_scan
from raychan.hil.session import CHANNELS, SCANNER, Session
from raychan.hil.summary import one_line, summary, warnings
from raychan.hil.telegrams import TelegramReader
from raychan.run.ship.scene import ship_scene


class Pipe:
    """A port whose peer is the test: it reads all that is written."""

    name, paced, unread, reconnects, here = "pipe", True, 0, 0, True

    def __init__(self):
        self.ours, self.theirs = os.pipe()
        self.got = b""

    def fileno(self):
        return self.ours

    def send(self, data):
        os.write(self.theirs, data)

    def look(self, now):
        pass

    def read(self):
        return os.read(self.ours, 4096)

    def write(self, data):
        self.got += data
        return len(data)

    def set_baud(self, baud):
        pass

    def close(self):
        os.close(self.ours)
        os.close(self.theirs)


class SlowShip(ScannedShip):
    """A ship whose scans take their time."""

    takes = 0.0

    def step_scan(self):
        time.sleep(self.takes)
        return super().step_scan()


@pytest.fixture
def session():
    loop = SlowShip(ship_scene(tomllib.loads(SCENE)))
    ports = {name: Pipe() for name in CHANNELS}
    made = Session(loop, {name: Channel(name, port, 500_000) for name, port in ports.items()}, Origin(54.0, 8.0), 10.0)
    yield made
    for port in ports.values():
        port.close()


def frames(session):
    return TelegramReader().feed(session.channels[SCANNER].port.got)


def test_scans_are_those_of_the_loop_one_after_another(session):
    session.scanner.mode = 0x24
    session.run(1.0, lambda: False)
    again = ScannedShip(ship_scene(tomllib.loads(SCENE)))
    found = [decode_scan(t.payload).range_m for t in frames(session)]
    assert len(found) > 10
    wanted = [again.step_scan().scan.range for _ in range(80)]
    # A pause of the machine may leave scans out, never change one or its place.
    at = 0
    for ranges in found:
        while not np.allclose(np.minimum(ranges, 99.0), np.minimum(wanted[at], 99.0), atol=5.1e-3):
            at += 1
        at += 1


def test_a_loop_that_is_too_slow_is_said_and_what_is_not_made_is_counted(session):
    session.loop.takes = 0.05
    session.scanner.mode = 0x24
    session.run(2.0, lambda: False)
    numbers = summary(session)
    scans, sentences = numbers["scans"], numbers["sentences"]
    assert scans["ticks"] + scans["missed"] == pytest.approx(150, abs=12)
    assert sentences["ticks"] + sentences["missed"] == pytest.approx(20, abs=3) and sentences["ticks"] >= 10
    assert scans["behind_at_end"] > 50 and "too slow" in warnings(numbers)[0]
    assert "ticks missed" in one_line(numbers) and session.ended == "duration"
    assert "ms (99 %), ordinary in turn" in one_line(numbers)
    position = session.channels["position"].port.got.split(b"\r\n")
    times = [float(line.split(b",")[1]) for line in position if line.startswith(b"$GPGGA")]
    # hhmmss.ss, so that midnight is a step by 240000.
    assert all((b - a) % 240_000 < 120_000 for a, b in pairwise(times)), "its time does not run backwards"


def test_the_ship_goes_on_at_its_place_when_the_fan_changes(session):
    session.channels[SCANNER].port.send(command("3B 64 00 19 00") + command("20 24"))
    before = session.loop.state
    session.run(1.0, lambda: False)
    scans = [decode_scan(t.payload) for t in frames(session) if t.payload[0] == 0xB0]
    assert {len(scan.range_m) for scan in scans} == {401} and len(scans) > 3
    assert 0.3 < session.loop.now < 1.2, "53 ms each, from where it was"
    along = np.linalg.norm(session.loop.state[3:5] - before[3:5])
    assert along == pytest.approx(10.289 * (session.loop.now - 1 / 75), rel=0.02)


def test_a_run_ends_when_it_is_told_to(session):
    session.run(60.0, lambda: session.loop.now > 0.2)
    assert session.ended == "stopped" and not warnings(summary(session))


def test_an_order_that_stops_the_ship_is_taken_back_and_the_lines_go_on(session):
    real, refuses = session.loop.step_scan, []

    def step_scan():
        if session.loop._steered._helm is not None:
            refuses.append(1)
            raise ValueError("the ship must go ahead")
        return real()

    session.loop.step_scan = step_scan
    session.channels["heading"].port.send(order_sentence(rudder_deg=5.0))
    session.run(1.0, lambda: False)
    assert (session.host.orders, session.host.orders_refused, len(refuses)) == (1, 1, 1)
    assert session.ended == "duration" and session.loop.now > 0.3


def test_a_ship_that_cannot_sail_on_ends_the_run(session):
    def step_scan():
        raise ValueError("the model does not hold")

    session.loop.step_scan = step_scan
    session.run(1.0, lambda: False)
    assert session.failed and "cannot sail on" in session.ended and "does not hold" in summary(session)["ended"]


def test_a_run_without_a_host_states_no_drift(session):
    for channel in session.channels.values():
        channel.port.here = False
    session.run(0.3, lambda: False)
    numbers = summary(session)
    assert {c["sent"] for c in numbers["channels"].values()} == {0}
    assert {c[k] for c in numbers["channels"].values() for k in ("drift_ms", "jitter_p99_ms")} == {None}
    assert isinstance(numbers["scans"]["drift_ms"], float)
    line = one_line(numbers)
    assert "; nothing sent, no drift and jitter measured, " in line and "ms (99 %)" not in line
