"""The simulated Loadstar by its bytes."""

import pytest

from sim_devices.instruments.serial_lines.loadstar import Loadstar, LoadstarOptions


def device(force=10.0, **options):
    return Loadstar(LoadstarOptions("loadstar", "p", **{"unit": "N", **options}), lambda: force)


def test_answers():
    cell = device()
    asked = (
        ("", "A"), ("model", "FCM DI-1000"), ("ID", "F1234-5678"), ("UNIT", "N"), ("units", "N"), ("lc", "500.00"),
        ("w", "     10.0000"), ("swc", "0.0001000000"), ("what", "E"), ("ct0", "Tared"), ("W", "      0.0000"),
        ("units kg", "Kg"), ("UNIT", "Kg"),
    )  # fmt: skip
    for command, answer in asked:
        assert cell.feed(f"{command}\r".encode(), 0.0) == f"{answer}\r\n".encode(), command


def test_both_streams_until_an_empty_command():
    cell = device(rate=10.0, fast_rate=100.0)
    assert cell.feed(b"WC\r", 0.0) == b""
    assert cell.tick(0.2) == b"     10.0000\r\n" * 2
    assert cell.feed(b"\r", 0.25) == b"A\r\n"
    assert cell.tick(5.0) == b""
    cell.feed(b"h\r", 5.0)
    assert cell.tick(5.0101) == b" 0186A0\r"
    assert device(-10.0).feed(b"H\r", 0.0) == b""
    negative = device(-10.0, odd=2, fast_rate=100.0)
    negative.feed(b"H\r", 0.0)
    assert negative.tick(0.0201) == b"-0186A0\r-000001\r"
    assert device(fast_rate=0.0).feed(b"H\r", 0.0) == b"E\r\n"


def test_faults():
    cell = device(rate=10.0)
    cell.feed(b"WC\r", 0.0)
    cell.fault("wrong_unit", 0.0)
    assert cell.tick(0.1) == b"      1.0197\r\n"
    cell.fault("factor", 0.1, 2.0)
    cell.clear(0.1)
    assert cell.tick(0.2) == b"     10.0000\r\n"
    cell.fault("reboot", 0.2)
    assert cell.tick(1.0) == b""
    cell.fault("silent", 1.0)
    assert cell.feed(b"\r", 1.0) == b""
    with pytest.raises(ValueError, match="expected one of"):
        cell.fault("tired", 0.0)
    for options in ({"unit": "stone"}, {"rate": 0.0}):
        with pytest.raises(ValueError, match="must be"):
            LoadstarOptions("loadstar", "p", **options)
