"""Orders are found in any stream; what is none is counted; positions lie where the ellipsoid has them."""

import math
from datetime import UTC, datetime
from types import SimpleNamespace

import numpy as np
import pytest
from pynmeagps import NMEAReader

from raychan.hil.geodesy import FLATTENING, SEMI_MAJOR_M, Origin, geocentric
from raychan.hil.instruments import Instruments, ScannedShip, reading
from raychan.hil.orders import Order, OrderReader, order_sentence
from raychan.run.ship.scene import ship_scene


def test_an_order_comes_back_as_sent():
    assert order_sentence(-12.5, 80.0) == b"$PRCHN,-12.5,80*7A\r\n"
    (found,) = OrderReader().feed(order_sentence(-12.5, 90.0))
    assert found == Order(pytest.approx(math.radians(-12.5)), 1.5)


def test_an_empty_field_gives_back_to_the_autopilot():
    found = OrderReader().feed(order_sentence() + order_sentence(rudder_deg=3.0) + order_sentence(shaft_rpm=60.0))
    assert found == [Order(None, None), Order(pytest.approx(math.radians(3.0)), None), Order(None, 1.0)]


@pytest.mark.parametrize("flip", range(8 * len("$PRCHN,-12.5,80*27")))
def test_no_flipped_bit_makes_another_order(flip):
    data = bytearray(order_sentence(-12.5, 80.0))
    data[flip // 8] ^= 1 << flip % 8
    reader = OrderReader()
    found = reader.feed(bytes(data))
    if data.upper() == order_sentence(-12.5, 80.0).upper() and flip // 8 > 15:
        assert len(found) == 1, "a hexadecimal digit may be of either case"
    else:
        assert found == [] and reader.bad + reader.ignored >= 1


def with_check_sum(content):
    check = 0
    for character in content.encode():
        check ^= character
    return f"${content}*{check:02X}\r\n".encode()


NO_NUMBERS = ["1_0,5", " 10 ,5", "1e1,5", "0x10,5", "+,5", "-.,5", ".,5", "1.2.3,5", "1,5\x1f", f"{'9' * 200}e9,"]


@pytest.mark.parametrize("content", ["PRCHN", "PRCHN,1", "PRCHN,1,2,3", "PRCHN,one,2", "PRCHN,nan,2", "PRCHN,,inf"])
def test_an_order_with_wrong_fields_is_bad(content):
    reader = OrderReader()
    assert reader.feed(with_check_sum(content)) == [] and reader.bad == 1


@pytest.mark.parametrize("fields", NO_NUMBERS)
def test_a_field_that_is_no_plain_decimal_number_is_bad(fields):
    reader = OrderReader()
    assert reader.feed(with_check_sum(f"PRCHN,{fields}")) == [] and reader.bad == 1


def test_decimal_numbers_of_any_form_are_taken_and_small_ones_come_back():
    for text, value in (("10", 10.0), ("+10.", 10.0), ("-.5", -0.5), ("007.50", 7.5)):
        (found,) = OrderReader().feed(with_check_sum(f"PRCHN,{text},"))
        assert math.degrees(found.rudder) == pytest.approx(value)
    (found,) = OrderReader().feed(order_sentence(2e-5, 1234567.0))
    assert math.degrees(found.rudder) == pytest.approx(2e-5) and found.shaft * 60.0 == pytest.approx(1234567.0)


def test_orders_without_a_check_sum_and_half_ones_are_bad_and_others_are_ignored():
    reader = OrderReader()
    assert reader.feed(b"$PRCHN,1,2\r\n$GPHDT,0.000,T*35\r\n\r\n") == []
    assert (reader.bad, reader.ignored) == (1, 1)
    assert len(reader.feed(b"$PRCHN,1," + order_sentence(4.0))) == 1 and reader.bad == 2
    reader.feed(b"$PRCHN,1")
    reader.give_up()
    assert reader.bad == 3 and len(reader.feed(order_sentence(4.0))) == 1


def test_garbage_without_an_end_is_dropped_and_orders_behind_it_are_found():
    rng, reader, found = np.random.default_rng(8), OrderReader(), 0
    for _ in range(200):
        noise = rng.integers(0, 256, int(rng.integers(0, 400)), dtype=np.uint8).tobytes()
        found += len(reader.feed(noise)) + len(reader.feed(b"\r\n" + order_sentence(1.0)))
    assert found == 200 and reader.bad > 100


def test_a_position_lies_where_exact_geocentric_vectors_put_it():
    rng = np.random.default_rng(1)
    for _ in range(200):
        lat, lon = rng.uniform(-85.0, 85.0), rng.uniform(-180.0, 180.0)
        north, east = rng.uniform(-5e3, 5e3, 2)
        found = Origin(lat, lon).to_globe(north, east)
        # The foot of the point on the ellipsoid, back in the tangent plane: off by height / R of it only.
        height = (north**2 + east**2) / 2.0 / 6.37e6
        delta = np.subtract(geocentric(*found, height), geocentric(lat, lon))
        s, c, sl, cl = *(f(math.radians(lat)) for f in (math.sin, math.cos)), math.sin(math.radians(lon)), 0.0
        cl = math.cos(math.radians(lon))
        back = np.array([[-s * cl, -s * sl, c], [-sl, cl, 0.0], [c * cl, c * sl, s]]) @ delta
        assert back[:2] == pytest.approx([north, east], abs=2e-3)


def test_degrees_near_the_origin_are_those_of_the_radii_of_curvature():
    e2, lat = FLATTENING * (2.0 - FLATTENING), math.radians(54.0)
    root = 1.0 - e2 * math.sin(lat) ** 2
    meridian, normal = SEMI_MAJOR_M * (1.0 - e2) / root**1.5, SEMI_MAJOR_M / math.sqrt(root)
    found = Origin(54.0, 8.0).to_globe(10.0, 20.0)
    assert math.radians(found[0] - 54.0) * meridian == pytest.approx(10.0, abs=1e-4)
    assert math.radians(found[1] - 8.0) * normal * math.cos(lat) == pytest.approx(20.0, abs=1e-4)


def test_a_degree_of_the_equator_is_111_319_m_and_the_pole_is_6_356_752_m_away():
    x, y, _ = geocentric(0.0, 1.0)
    assert math.atan2(y, x) * SEMI_MAJOR_M == pytest.approx(111_319.491, abs=1e-3)
    assert geocentric(90.0, 0.0)[2] == pytest.approx(6_356_752.3142, abs=1e-4)


@pytest.mark.parametrize("place", [(90.0, 0.0), (0.0, 181.0), (float("nan"), 0.0)])
def test_an_origin_off_the_globe_or_at_a_pole_is_refused(place):
    with pytest.raises(ValueError, match="allowed"):
        Origin(*place)


def frame(time, **others):
    base = {"north": 0.0, "east": 0.0, "z": 0.0, "heading": 0.0, "roll": 0.0, "pitch": 0.0, "rudder": 0.0}
    base |= {"rudder_sign": 1}
    return SimpleNamespace(time=time, **base | others)


def test_a_reading_lies_between_two_frames_and_headings_take_the_shorter_turn():
    before = frame(1.0, heading=math.radians(359.0), roll=0.2)
    after = frame(1.1, north=3.0, east=4.0, heading=math.radians(3.0), roll=0.1, pitch=0.02)
    found = reading(before, after, 1.05)
    assert math.degrees(found.heading) == pytest.approx(1.0) and found.roll == pytest.approx(0.15)
    assert (found.north, found.east) == pytest.approx((1.5, 2.0)) and found.speed == pytest.approx(50.0)
    assert math.degrees(found.course) == pytest.approx(53.130, abs=1e-3)
    assert found.pitch == pytest.approx(-0.01), "bow up is positive in sentences"


def test_the_sentences_of_a_cycle_say_one_time_and_one_place():
    instruments = Instruments(Origin(54.0, 8.0), datetime(2026, 12, 31, 23, 59, 59, 950_000, UTC))
    at = reading(frame(0.0), frame(0.2, north=1.0, east=1.0, roll=0.1), 0.1)
    first, second = (NMEAReader.parse(line + b"\r\n") for line in instruments.position(at).split(b"\r\n")[:2])
    assert (first.lat, first.lon) == (second.lat, second.lon) and first.time == second.time
    assert str(first.date) == "2027-01-01" and str(first.time).startswith("00:00:00.05")
    assert first.spd * 1852.0 / 3600.0 == pytest.approx(math.sqrt(50.0), abs=1e-3) and first.cog == 45.0
    lines = instruments.attitude(at).split(b"\r\n")
    assert [line[:6] for line in lines[:3]] == [b"$PASHR", b"$AGRSA", b"$PTNTH"]
    assert lines[1].startswith(b"$AGRSA,0.00,A,,V*"), "no -0.00"
    assert NMEAReader.parse(lines[0] + b"\r\n").roll == pytest.approx(math.degrees(0.05), abs=1e-3)


@pytest.mark.parametrize("model", ["printed", "corrected", "container", "yacht"])
@pytest.mark.parametrize("order_deg", [-10.0, 10.0])
def test_the_rudder_sentence_is_negative_where_the_bow_turns_to_port(model, order_deg):
    """NMEA 0183, RSA: '-' is bow turns to port."""
    loop = ScannedShip(ship_scene({"ship": {"model": model}, "steering": {"controller": "pd"}}))
    loop.order(rudder=math.radians(order_deg))
    frames = [loop.step_scan() for _ in range(300)]
    at = reading(frames[-2], frames[-1], frames[-1].time)
    sentence = Instruments(Origin(54.0, 8.0), datetime(2026, 1, 1, tzinfo=UTC)).attitude(at)
    told = float(sentence.split(b"\r\n")[1].split(b",")[1])
    assert abs(told) == pytest.approx(10.0, abs=0.3)
    assert (told < 0.0) == (frames[-1].yaw_rate < 0.0), "yaw rates are to starboard"
    assert math.degrees(frames[-1].rudder) == pytest.approx(order_deg, abs=0.3), "orders have the ship's own sign"
