"""The scanner answers what drivers of LMS2xx scanners send, as they expect it."""

import numpy as np
import pytest

from raychan.hil.lms import NAME, ON_REQUEST, STATUS_BYTE, STREAM, VARIANTS, Scanner, check_sendable
from raychan.hil.scans import DISTANCE_BITS, MOST_BEAMS, ScanValues, decode_scan, encode_scan
from raychan.hil.telegrams import ACK, HOST_TO_SCANNER, NAK, Telegram, TelegramError, TelegramReader, unframe
from raychan.sensors.laser import Scanner as Laser
from raychan.world.errors import SceneError

INSTALL = "20 00 53 49 43 4B 5F 4C 4D 53"


def values(count=181):
    return ScanValues(np.arange(count) * 0.01 + 1.0, np.zeros(count, np.uint8))


@pytest.fixture
def scanner():
    return Scanner(values)


def ask(scanner, payload):
    """Payload of the scanner's answer; None after NAK."""
    data = scanner.answer(Telegram(HOST_TO_SCANNER, bytes.fromhex(payload)))
    if data == bytes((NAK,)):
        return None
    assert data[0] == ACK
    return unframe(data[1:]).payload


def test_sicktoolbox_starts_up(scanner):
    # SickLMS2xx::Initialize: baud rate, mode 25, type, status, configuration; payload[1] of A0 must be 0.
    assert ask(scanner, "20 40")[:2] == b"\xa0\x00"
    assert ask(scanner, "20 25")[:2] == b"\xa0\x00"
    assert b"LMS221;30206" in ask(scanner, "3A")
    status = ask(scanner, "31")
    assert len(status) == 152 and status[8] == 0x25 and status[9] == 0
    assert [int.from_bytes(status[i : i + 2], "little") for i in (107, 109, 116)] == [180, 100, 0x8019]
    assert len(ask(scanner, "74")) == 36


def test_sicktoolbox_probes_baud_rates_by_asking_for_errors(scanner):
    # SickLMS2xx::_getSickErrors counts (payload length - 2) / 2 errors.
    assert ask(scanner, "32") == bytes((0xB2, STATUS_BYTE))


def test_mrpt_takes_a_new_baud_rate_only_with_status_byte_10(scanner):
    # CSickLaserSerial::LMS_setupSerialComms reads bytes 2, 4 and 6 of the frame.
    data = scanner.answer(Telegram(HOST_TO_SCANNER, b"\x20\x48"))[1:]
    assert (data[2], data[4], data[6]) == (0x03, 0xA0, 0x10)


def test_mrpt_writes_back_the_configuration_that_it_read(scanner):
    # CSickLaserSerial::LMS_sendMeasuringMode_cm_mm: 32 m and mm in bytes 6 and 7, 35 bytes long.
    assert ask(scanner, INSTALL)[:2] == b"\xa0\x00"
    read = ask(scanner, "74")
    told = ask(scanner, (b"\x77" + read[1:6] + b"\x06\x01" + read[8:35]).hex())
    assert told[:2] == b"\xf7\x01" and told[2:36] == read[1:6] + b"\x06\x01" + read[8:35]
    assert ask(scanner, "20 25")[:2] == b"\xa0\x00"
    assert ask(scanner, "3B B4 00 64 00")[:2] == b"\xbb\x01"
    status = ask(scanner, "31")
    assert (status[102], status[122]) == (6, 1)
    scan = decode_scan(ask(scanner, "30"), DISTANCE_BITS[6])
    assert scan.unit == 1 and scan.range_m == pytest.approx(values().range_m, abs=5e-4)


def test_aria_writes_a_shorter_configuration(scanner):
    # ArLMS2xx::internalConnectHandler: 33 bytes, measuring mode 1 or 5, straight from installation to streaming.
    assert ask(scanner, INSTALL)[:2] == b"\xa0\x00"
    assert ask(scanner, "77 00 00 46 00 00 01 00" + " 00" * 25)[:2] == b"\xf7\x01"
    assert ask(scanner, "20 24")[:2] == b"\xa0\x00" and scanner.streaming


def test_aria_waits_for_the_end_of_a_restart(scanner):
    scanner.mode, scanner.baud = STREAM, 38400
    assert ask(scanner, "10") == bytes((0x91, STATUS_BYTE))
    assert (scanner.mode, scanner.baud, scanner.starting) == (ON_REQUEST, 9600, True)
    assert unframe(scanner.started()).payload == b"\x90" + NAME + bytes((STATUS_BYTE,)) and not scanner.starting


def test_a_wrong_password_keeps_the_mode(scanner):
    ask(scanner, "20 24")
    assert ask(scanner, INSTALL[:-2] + "54")[:2] == b"\xa0\x01" and scanner.mode == STREAM


@pytest.mark.parametrize("change", ["06 02", "07 01", "3F 00"])
def test_a_unit_or_a_measuring_mode_that_it_has_not_is_not_taken(scanner, change):
    ask(scanner, INSTALL)
    before = ask(scanner, "74")
    told = ask(scanner, "77 00 00 46 00 00" + change)
    assert told[:2] == b"\xf7\x00" and ask(scanner, "74") == before


def test_outside_of_installation_mode_no_configuration_is_taken(scanner):
    assert ask(scanner, "77 00 00 46 00 00 06 01")[:2] == b"\xf7\x00" and scanner.unit == 0


def test_a_variant_changes_where_the_scanner_follows_and_stops_the_stream():
    asked = []
    scanner = Scanner(values, set_variant=lambda fan, step: asked.append((fan, step)) or True)
    ask(scanner, "20 24")
    assert ask(scanner, "3B 64 00 19 00") == b"\xbb\x01\x64\x00\x19\x00\x10"
    assert asked == [(100, 0.25)] and not scanner.streaming
    status = ask(scanner, "31")
    assert [int.from_bytes(status[i : i + 2], "little") for i in (107, 109)] == [100, 25]


@pytest.mark.parametrize("variant", ["65 00 64 00", "B4 00 63 00", "64 00 32 00"])
def test_a_variant_that_is_none_or_that_cannot_be_is_not_taken(scanner, variant):
    # The last one is a variant, but this scanner's fan is fixed.
    assert ask(scanner, "3B" + variant) == b"\xbb\x00\xb4\x00\x64\x00\x10"
    assert 100 in VARIANTS and (scanner.angle_deg, scanner.step_deg) == (180, 1.0)


@pytest.mark.parametrize("step, turns", [(1.0, 1), (0.5, 2), (0.25, 4)])
def test_each_turn_of_the_mirror_says_the_offset_of_its_beams(step, turns):
    # ROS sicktoolbox_wrapper streams a fan of 180 deg so (mode 2A); the offset is in quarters of a degree.
    whole = values(round(180 / step) + 1)
    scanner = Scanner(lambda: whole, step_deg=step)
    assert ask(scanner, "20 2A")[:2] == b"\xa0\x00" and scanner.streaming
    found = [decode_scan(t.payload) for t in TelegramReader().feed(scanner.scan())]
    assert [one.offset_deg for one in found] == [k * step for k in range(turns)]
    back = np.empty(len(whole.range_m))
    for k, one in enumerate(found):
        back[k::turns] = one.range_m
    assert back == pytest.approx(whole.range_m, abs=5e-3)
    word = int.from_bytes(TelegramReader().feed(scanner.scan())[-1].payload[1:3], "little")
    assert (word >> 11 & 3, word >> 13 & 1) == (round(4 * (turns - 1) * step), 1)


def test_some_beams_of_a_scan_are_streamed(scanner):
    assert ask(scanner, "20 27 0B 00 14 00")[:2] == b"\xa0\x00"
    payload = unframe(scanner.scan()).payload
    assert payload[:5] == b"\xb7\x0b\x00\x14\x00"
    found = decode_scan(payload)
    assert found.first == 11 and found.range_m == pytest.approx(values().range_m[10:20], abs=5e-3)


@pytest.mark.parametrize("mode", ["27 00 00 14 00", "27 14 00 0B 00", "27 01 00 B6 00", "27 01", "26 02", "50"])
def test_modes_that_it_has_not_are_refused(scanner, mode):
    assert ask(scanner, "20" + mode) is None and scanner.mode == ON_REQUEST and scanner.refused == 1


@pytest.mark.parametrize("mode, bits", DISTANCE_BITS.items())
def test_a_distance_has_the_bits_of_its_measuring_mode(mode, bits):
    none = (1 << bits) - 1
    scan = ScanValues(np.array([(none - 1) * 0.001, np.inf]), np.zeros(2, np.uint8), unit=1, bits=bits)
    found = decode_scan(encode_scan(scan), bits)
    assert found.range_m.tolist() == [pytest.approx((none - 1) * 0.001), np.inf]
    with pytest.raises(TelegramError, match="fields"):
        encode_scan(ScanValues(np.ones(1), np.array([1 << (16 - bits)], int), bits=bits))


@pytest.mark.parametrize("payload", ["20 42 00", "20 24 00", "20 25 01", "20 2A 00", "20 27 01 00 05 00 00"])
def test_a_mode_with_a_byte_too_many_is_refused_and_changes_nothing(scanner, payload):
    assert ask(scanner, payload) is None
    assert (scanner.baud, scanner.mode) == (9600, ON_REQUEST)


@pytest.mark.parametrize(("mirror_hz", "turns"), [(75.0, 4500), (50.0, 3000), (10_000.0, 65_535)])
def test_the_status_tells_the_turns_of_the_mirror(mirror_hz, turns):
    status = ask(Scanner(values, mirror_hz=mirror_hz), "31")
    assert int.from_bytes(status[67:69], "little") == turns


def test_what_telegrams_cannot_tell_of_a_scanner_is_said():
    assert not check_sendable(Laser(180.0, 0.25))
    assert "46 for 45.5" in check_sendable(Laser(45.5, 0.5))[0]
    assert "65,535" in check_sendable(Laser(180.0, 1.0, 2000.0))[0]


def test_the_widest_fan_fits_into_telegrams_whole_and_in_part_and_a_wider_one_is_refused():
    widest = Scanner(lambda: values(MOST_BEAMS))
    assert len(decode_scan(unframe(widest.scan()).payload).range_m) == MOST_BEAMS
    assert ask(widest, "20 27 01 00 " + MOST_BEAMS.to_bytes(2, "little").hex()) is not None
    assert len(decode_scan(unframe(widest.scan()).payload).range_m) == MOST_BEAMS
    fan = (MOST_BEAMS - 1) * 0.25
    assert not [x for x in check_sendable(Laser(fan, 0.25)) if "beams" in x]
    with pytest.raises(SceneError, match=r"scanner\.fan_deg: a scan of 1,021 beams"):
        check_sendable(Laser(fan + 0.25, 0.25))
