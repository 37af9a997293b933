"""Telegrams are those that drivers of LMS2xx scanners send and read; no flipped bit goes unnoticed."""

import numpy as np
import pytest

from raychan.hil.lms import BAUD_CODES, Scanner
from raychan.hil.scans import NO_ECHO, UNITS_M, ScanValues, decode_scan, encode_scan
from raychan.hil.telegrams import (
    ACK,
    HOST_TO_SCANNER,
    NAK,
    Telegram,
    TelegramError,
    TelegramReader,
    crc,
    frame,
    unframe,
)

VECTORS = {
    "20 24": "34 08", "31": "15 12", "20 25": "35 08", "20 40": "50 08", "20 42": "52 08", "20 48": "58 08",
    "30": "14 12", "3A": "1E 12", "74": "50 12",
}  # fmt: skip
"""Payloads of hosts, and the CRC that drivers made by others send with them."""


def random_scan(rng, count):
    unit = int(rng.integers(2))
    counts = rng.integers(0, NO_ECHO + 1, count)
    ranges = np.where(counts == NO_ECHO, np.inf, counts * UNITS_M[unit])
    return ScanValues(ranges, rng.integers(0, 8, count).astype(np.uint8), unit, int(rng.integers(256)))


@pytest.mark.parametrize("payload, check", VECTORS.items())
def test_check_sums_are_those_of_drivers_made_by_others(payload, check):
    data = frame(bytes.fromhex(payload), HOST_TO_SCANNER)
    assert data[-2:] == bytes.fromhex(check)
    assert crc(data[:-2]) == int.from_bytes(bytes.fromhex(check), "little")


def test_the_start_of_streaming_is_the_printed_telegram():
    assert frame(b"\x20\x24", HOST_TO_SCANNER) == bytes.fromhex("02 00 02 00 20 24 34 08")


def test_ten_thousand_random_scans_come_back_as_sent():
    rng = np.random.default_rng(15)
    for i in range(10_000):
        sent = random_scan(rng, (181, 361, 721)[i % 3] if i % 10 == 0 else int(rng.integers(0, 40)))
        telegram = unframe(frame(encode_scan(sent)))
        found = decode_scan(telegram.payload)
        np.testing.assert_array_equal(found.range_m, sent.range_m)
        np.testing.assert_array_equal(found.fields, sent.fields)
        assert (found.unit, found.status, telegram.address) == (sent.unit, sent.status, 0x80)


@pytest.mark.parametrize("count, size", [(181, 372), (361, 732), (721, 1452)])
def test_a_scan_has_its_length_and_each_flipped_bit_is_noticed(count, size):
    good = frame(encode_scan(random_scan(np.random.default_rng(count), count)))
    assert len(good) == size and good[:5] == bytes((0x02, 0x80, *(size - 6).to_bytes(2, "little"), 0xB0))
    # All bits of the shortest scan; of the longer ones a step that is prime to 8 reaches every bit of a byte.
    for bit in range(0, 8 * size, 1 if count == 181 else 7):
        bad = bytearray(good)
        bad[bit // 8] ^= 1 << bit % 8
        with pytest.raises(TelegramError):
            unframe(bytes(bad))


def test_values_beyond_13_bits_are_no_echo():
    payload = encode_scan(ScanValues(np.array([81.90, 81.92, 500.0, np.inf]), np.zeros(4, np.uint8)))
    assert decode_scan(payload).range_m.tolist() == [pytest.approx(81.90), np.inf, np.inf, np.inf]


def test_fields_lie_in_bits_13_to_15_and_the_unit_in_14_of_the_count():
    payload = encode_scan(ScanValues(np.array([1.234]), np.array([5], np.uint8), unit=1, status=0x10))
    assert payload == bytes((0xB0, 0x01, 0x40)) + (1234 | 5 << 13).to_bytes(2, "little") + b"\x10"


@pytest.mark.parametrize(
    "scan",
    [
        ScanValues(np.array([-1.0]), np.zeros(1, np.uint8)),
        ScanValues(np.array([np.nan]), np.zeros(1, np.uint8)),
        ScanValues(np.array([1.0]), np.array([8], np.uint8)),
        ScanValues(np.array([1.0]), np.zeros(2, np.uint8)),
        ScanValues(np.array([1.0]), np.zeros(1, np.uint8), unit=2),
    ],
)
def test_a_scan_that_no_telegram_holds_is_refused(scan):
    with pytest.raises(TelegramError):
        encode_scan(scan)


@pytest.mark.parametrize("payload", ["", "B1 00 00 00", "B0 02 00 01 00 00", "B0 00 80 00"])
def test_a_payload_that_is_no_scan_is_refused(payload):
    with pytest.raises(TelegramError):
        decode_scan(bytes.fromhex(payload))


def test_a_stream_in_pieces_with_garbage_gives_each_good_telegram_once_and_counts_the_rest():
    rng = np.random.default_rng(4)
    good = [encode_scan(random_scan(rng, 181)) for _ in range(20)]
    bad = bytearray(frame(good[0]))
    bad[100] ^= 4
    stream = bytes((ACK, NAK, 0x55)) + bytes(bad) + b"".join(frame(p) for p in good)
    reader, found = TelegramReader(), []
    while stream:
        n = int(rng.integers(1, 300))
        found += reader.feed(stream[:n])
        stream = stream[n:]
    found += reader.give_up()
    assert [t.payload for t in found if len(t.payload) > 100] == good
    assert reader.damaged >= 1 and reader.acknowledged >= 1 and reader.refused >= 1
    assert reader.skipped >= 1 and reader.waiting == 0


def test_half_a_telegram_waits_until_the_line_is_given_up():
    reader, data = TelegramReader(), frame(b"\x31", HOST_TO_SCANNER)
    assert reader.feed(data[:5]) == [] and reader.waiting == 5
    assert reader.give_up() == [] and reader.waiting == 0 and reader.damaged >= 1
    assert reader.feed(data) == [Telegram(HOST_TO_SCANNER, b"\x31")]


def ask(scanner, payload):
    """Payload of the scanner's answer."""
    data = scanner.answer(Telegram(HOST_TO_SCANNER, bytes.fromhex(payload)))
    assert data[0] == ACK
    return unframe(data[1:]).payload


@pytest.fixture
def scanner():
    return Scanner(lambda: ScanValues(np.full(181, 7.25), np.zeros(181, np.uint8)))


@pytest.mark.parametrize("command, answer", [("20 25", 0xA0), ("30", 0xB0), ("31", 0xB1), ("3A", 0xBA), ("74", 0xF4)])
def test_an_answer_is_the_command_with_80_added(scanner, command, answer):
    assert ask(scanner, command)[0] == answer


@pytest.mark.parametrize("code, baud", BAUD_CODES.items())
def test_baud_codes_switch_the_line(scanner, code, baud):
    assert ask(scanner, f"20 {code:02X}")[:2] == b"\xa0\x00" and scanner.baud == baud


def test_streaming_starts_and_stops_and_the_status_tells_it(scanner):
    for mode, streams in (("24", True), ("25", False)):
        ask(scanner, f"20 {mode}")
        status = ask(scanner, "31")
        assert scanner.streaming is streams and status[8] == int(mode, 16)
    assert len(status) == 152 and status[9] == 0 and status[122] == 0
    assert [int.from_bytes(status[i : i + 2], "little") for i in (67, 107, 109)] == [4500, 180, 100]


def test_a_poll_returns_the_last_scan(scanner):
    assert (decode_scan(ask(scanner, "30")).range_m == 7.25).all()


def test_unknown_commands_are_refused_and_counted_and_others_telegrams_left_alone(scanner):
    for payload in (b"\x77", b"\x20", b"\x20\x99"):
        assert scanner.answer(Telegram(HOST_TO_SCANNER, payload)) == bytes((NAK,))
    assert scanner.refused == 3
    assert scanner.answer(Telegram(0x80, b"\x31")) == b""


@pytest.mark.parametrize("size", [0, 2049])
def test_a_payload_that_does_not_fit_is_refused(size):
    with pytest.raises(TelegramError):
        frame(bytes(size))
