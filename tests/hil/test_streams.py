"""Four streams go through pseudo-terminals unchanged, NMEA says what was put in, lines take their time."""

import os
from datetime import time

import numpy as np
import pytest
from pynmeagps import NMEAReader, calc_checksum

from raychan.hil.nmea import Attitude, Fix, gga, hdt, pashr, ptnthtm
from raychan.hil.pacing import Line, Schedule, Timing, line_time
from raychan.hil.ports import open_port, pseudo_terminal
from raychan.hil.scans import ScanValues, decode_scan, encode_scan
from raychan.hil.telegrams import TelegramReader, frame

AT = time(10, 11, 12, 340_000)


def checked(sentence):
    """Fields of a sentence whose check sum a plain XOR confirms."""
    content, _, check = sentence.decode().strip().removeprefix("$").partition("*")
    total = 0
    for character in content:
        total ^= ord(character)
    assert f"{total:02X}" == check == calc_checksum(content) and sentence.endswith(b"\r\n")
    return content.split(",")


def test_gga_says_the_position_to_a_millimetre():
    rng = np.random.default_rng(2)
    for _ in range(300):
        lat, lon = rng.uniform(-90.0, 90.0), rng.uniform(-180.0, 180.0)
        sentence = gga(Fix(AT, lat, lon, 12.345))
        checked(sentence)
        found = NMEAReader.parse(sentence)
        assert (found.lat, found.lon) == (pytest.approx(lat, abs=9e-9), pytest.approx(lon, abs=9e-9))
        assert found.alt == 12.345 and found.quality == 1 and found.time == AT


def test_minutes_never_round_to_60():
    fields = checked(gga(Fix(AT, 59.99999999999, -1e-12, 0.0)))
    assert fields[2:6] == ["6000.0000000", "N", "00000.0000000", "W"]


def test_headings_are_true_and_below_360():
    assert NMEAReader.parse(hdt(-90.0)).headingT == 270.0
    assert checked(hdt(359.99999)) == ["GPHDT", "0.000", "T"]
    assert checked(hdt(1.0, "HE"))[0] == "HEHDT"


def test_attitude_has_roll_before_pitch_in_pashr_and_after_it_in_ptnthtm():
    attitude = Attitude(AT, 45.0, roll_deg=-3.25, pitch_deg=1.5)
    found = NMEAReader.parse(pashr(attitude))
    assert (found.trueHdg, found.roll, found.pitch) == (45.0, -3.25, 1.5)
    fields = checked(ptnthtm(attitude))
    # As in the compass's own $PTNTHTM,285.2,N,-2.4,N,10.7,N,59.1,3844*27.
    assert fields == ["PTNTHTM", "45.000", "N", "1.500", "N", "-3.250", "N", "0.0", "0"]


@pytest.mark.parametrize("lat, lon, height", [(91.0, 0.0, 0.0), (0.0, -181.0, 0.0), (0.0, np.nan, 0.0), (0, 0, np.inf)])
def test_a_position_off_the_globe_is_refused(lat, lon, height):
    with pytest.raises(ValueError, match="allowed"):
        gga(Fix(AT, lat, lon, height))


def test_four_streams_go_through_pseudo_terminals_byte_for_byte():
    ranges = np.linspace(1.0, 80.0, 181).round(2)
    attitude = Attitude(AT, 12.0, 3.0, -1.0)
    streams = [
        frame(encode_scan(ScanValues(ranges, np.zeros(181, np.uint8)))),
        gga(Fix(AT, 55.0, -1.5, 3.0)), hdt(12.0), pashr(attitude),
    ]  # fmt: skip
    found = []
    for data in streams:
        pair = pseudo_terminal()
        with open_port(pair.name, 38400) as port:
            os.write(pair.ours, data)
            found.append(port.read(len(data)))
            port.write(b"\x02\x00\x0a\x0d\x11\x13\x03\xff")
            assert os.read(pair.ours, 99) == b"\x02\x00\x0a\x0d\x11\x13\x03\xff"
        os.close(pair.held)
        os.close(pair.ours)
    assert found == streams
    (telegram,) = TelegramReader().feed(found[0])
    np.testing.assert_allclose(decode_scan(telegram.payload).range_m, ranges, atol=1e-9)
    for sentence in found[1:]:
        checked(sentence)


def test_a_port_that_is_not_there_is_named():
    with pytest.raises(OSError, match="no_such_port"):
        open_port("/dev/no_such_port", 9600)


@pytest.mark.parametrize("baud, seconds", [(9600, 0.388), (38400, 0.097), (500_000, 7.44e-3)])
def test_a_scan_of_372_bytes_takes_its_time_on_the_line(baud, seconds):
    assert line_time(372, baud) == pytest.approx(seconds, rel=0.01)


def test_9600_baud_carry_gga_and_hdt_about_nine_times_a_second():
    together = len(gga(Fix(AT, 55.0, -1.5, 3.0))) + len(hdt(12.0))
    assert 1.0 / line_time(together, 9600) == pytest.approx(9.0, abs=1.0)


@pytest.mark.parametrize("baud, rate", [(38400, 10), (500_000, 75)])
def test_a_line_carries_what_fits_and_counts_what_does_not(baud, rate):
    line = Line(baud)
    ends = [line.offer(k / 75.0, 372) for k in range(75 * 60)]
    left = np.array([end for end in ends if end is not None])
    assert line.sent == len(left) and line.sent + line.dropped == 75 * 60
    assert line.sent / 60 == pytest.approx(rate, rel=0.07)
    assert (np.diff(left) >= line_time(372, baud) - 1e-12).all()


def test_a_schedule_does_not_add_up_lateness():
    schedule, rng, now = Schedule(1e6, 1 / 75), np.random.default_rng(5), 0.0
    for _ in range(75 * 300):
        now = max(now, schedule.due) + rng.uniform(0.0, 1e-3)
        assert schedule.tick(now) == 0
    timing = schedule.timing()
    assert schedule.due == pytest.approx(1e6 + 300.0, abs=1e-6) and timing.ticks == 75 * 300 and timing.missed == 0
    assert abs(timing.drift) < 1e-4 and timing.jitter_p99 == pytest.approx(0.495e-3, rel=0.02)


def test_ticks_slept_through_are_passed_over_and_counted():
    schedule = Schedule(0.0, 0.1)
    schedule.tick(0.0)
    assert schedule.tick(0.45) == 3
    assert schedule.due == pytest.approx(0.5) and schedule.timing().missed == 3


def test_a_clock_that_runs_slow_shows_as_drift():
    schedule = Schedule(0.0, 0.1)
    for k in range(1000):
        schedule.tick(k * 0.1 * (1.0 + 1e-5))
    assert schedule.timing().drift == pytest.approx(0.9 * 1000 * 0.1 * 1e-5, rel=0.01)


def test_an_empty_schedule_has_no_timing_and_a_period_is_above_zero():
    assert Schedule(0.0, 1.0).timing() == Timing(0, 0, 0.0, 0.0)
    with pytest.raises(ValueError, match="period"):
        Schedule(0.0, 0.0)
