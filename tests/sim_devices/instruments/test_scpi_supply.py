"""The simulated supply: what it answers, its protections and watchdog, and all that it can do wrong."""

import pytest

from sim_devices.instruments.scpi.supply import Measured, ScpiSupply, ScpiSupplyOptions


class Bed:
    def __init__(self, **options):
        self.log, self.t = [], 0.0
        made = ScpiSupplyOptions("scpi_supply", "p", **options)
        self.now = Measured(12.0, 1.5)
        self.device = ScpiSupply(made, lambda: self.now, lambda event, **more: self.log.append((event, more)))

    def say(self, *commands):
        return self.device.feed("".join(f"{command}\n" for command in commands).encode(), self.t).decode()


def test_answers():
    bed = Bed()
    assert bed.say("*IDN?", "*OPC?") == "SIM,PSU-60,1234,1.0\r\n1\r\n"
    assert bed.say("VOLT 12.5", "VOLT?", ":SOURce:VOLTage:LEVel?") == "12.5000\r\n12.5000\r\n"
    assert bed.say("MEAS:VOLT?", "MEASure:CURRent?") == "12.0000\r\n1.5000\r\n"
    assert bed.say("curr 2", "curr?", "outp?") == "2.0000\r\n0\r\n"
    assert bed.say("VO") == ""
    assert bed.say("LT?") == ""
    assert bed.say("SYST:ERR?", "SYST:ERR?") == '-113,"Undefined header"\r\n-113,"Undefined header"\r\n'
    assert bed.say("SYST:ERR?", "VOLT 100", "VOLT x", "SYST:ERR?", "SYST:ERR?") == (
        '0,"No error"\r\n-222,"Data out of range"\r\n-104,"Data type error"\r\n'
    )
    assert bed.say("NONE", "*CLS", "SYST:ERR?") == '0,"No error"\r\n'


def test_output():
    bed = Bed()
    assert bed.device.drive(0.0, 0.001) == (None, 0.0)
    bed.say("VOLT 12", "OUTP ON")
    assert bed.device.drive(0.0, 0.001) == (12.0, 0.0)
    bed.say("VOLT 0")
    assert bed.device.drive(0.0, 0.001) == (0.0, 0.0)
    bed.say("OUTP OFF")
    assert bed.device.drive(0.0, 0.001) == (None, 0.0)
    assert [more["volts"] for _, more in bed.log] == [12.0, 0.0]


def test_over_voltage_latches():
    bed = Bed()
    bed.say("VOLT:PROT 20", "OUTP ON", "VOLT 21")
    assert not bed.device.on
    assert bed.say("VOLT 5", "OUTP ON", "OUTP?") == "1\r\n", "its programmed state"
    assert not bed.device.on
    bed.say("OUTP:PROT:CLE")
    assert bed.device.drive(0.0, 0.001) == (5.0, 0.0)


def test_the_watchdog_latches_and_who_clears_it_gets_back_what_was():
    bed = Bed()
    bed.say("OUTP:PROT:WDOG:DEL 0.5", "OUTP:PROT:WDOG ON", "VOLT 12", "OUTP ON")
    bed.t = 0.4
    bed.say("*IDN?")
    assert bed.device.due == pytest.approx(0.9), "any word feeds it"
    bed.t = 1.0
    bed.device.tick(1.0)
    assert not bed.device.on
    assert bed.log[-2][0] == "timeout"
    assert bed.say("OUTP?") == "1\r\n"
    bed.say("OUTP:PROT:CLE")
    assert bed.device.drive(0.0, 0.001) == (12.0, 0.0), "the trap: it goes on"
    without = Bed(has_watchdog=False)
    assert without.say("OUTP:PROT:WDOG?") == ""
    broken = Bed(broken_watchdog=True)
    broken.say("OUTP:PROT:WDOG ON", "OUTP ON")
    assert broken.device.due == float("inf")


def test_faults():
    bed = Bed()
    bed.say("VOLT 12", "OUTP ON", "MEAS:VOLT?")
    bed.device.fault("frozen", 0.0)
    bed.now = Measured()
    assert bed.say("MEAS:VOLT?") == "12.0000\r\n"
    bed.device.fault("ignores_commands", 0.0)
    bed.say("OUTP OFF")
    assert bed.device.on
    bed.device.fault("redrives", 0.0, 0.5)
    assert bed.device.drive(0.0, 0.001) == (30.0, 0.0)
    bed.now = Measured(12.0, 2.0)
    bed.device.fault("current_factor", 0.0, 2.0)
    assert bed.say("MEAS:CURR?") == "4.0000\r\n"
    bed.device.fault("error", 0.0)
    assert bed.say("SYST:ERR?") == '-240,"Hardware error"\r\n'
    bed.device.fault("output_off", 0.0)
    assert not bed.device.on
    bed.device.fault("silent", 0.0)
    assert bed.say("*IDN?") == ""
    bed.device.clear(0.0)
    bed.device.fault("reboot", 0.0)
    assert bed.say("*IDN?") == ""
    bed.t = 1.0
    assert bed.say("OUTP?", "VOLT?") == "0\r\n0.0000\r\n"
    with pytest.raises(ValueError, match="expected one of frozen"):
        bed.device.fault("pulled", 0.0)


def test_impossible_options():
    with pytest.raises(ValueError, match="above 0"):
        ScpiSupplyOptions("scpi_supply", "p", max_voltage=0.0)
