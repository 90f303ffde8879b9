"""Every kind of device that a bench file can name."""

from __future__ import annotations

from drivers import KINDS
from drivers.ports.can_bus import CanBus
from drivers.protocols import Instrument, MotorController

MAP = 'title="T"\nsource="t"\nfunction=3\n[channels.bus_voltage]\nregister=0\ntype="u16"\nunit="V"\n'
SIGNALS = 'title="T"\nsource="t"\ndbc="x.dbc"\n[rates]\nM=1.0\n[channels.torque]\nsignal="M.t"\nunit="N.m"\n'
DBC = 'VERSION ""\n\nNS_ :\n\nBS_:\n\nBU_: A\n\nBO_ 256 M: 2 A\n SG_ t : 0|16@1- (1,0) [0|0] "" A\n'


def test_every_kind_is_an_instrument_and_only_the_motor_commands(tmp_path):
    channels = tmp_path / "map.toml"
    channels.write_text(MAP, encoding="utf-8")
    signals = tmp_path / "signals.toml"
    signals.write_text(SIGNALS, encoding="utf-8")
    (tmp_path / "x.dbc").write_text(DBC, encoding="utf-8")
    options = {
        "mt_sics": {"port": "p", "rate": 10.0},
        "loadstar": {"port": "p", "rate": 50.0},
        "pzem": {"port": "p"},
        "maestro": {"port": "p", "channel": 0, "full_voltage": 48.0, "dead_zone": 25.0, "watchdog_timeout": 0.5},
        "hbm_aed": {"port": "p", "rate": 25.0, "top_rate": 100.0, "nominal_force": 500.0},
        "mantracourt_dsc": {"port": "p", "rate": 50.0, "unit": "N"},
        "sartorius_sbi": {"port": "p", "rate": 10.0},
        "line_stream": {"port": "p", "pattern": r"(?P<value>\d+)", "rate": 10.0, "line_characters": 10},
        "modbus_cell": {"port": "p", "map": "laumas", "rate": 10.0, "unit": "kg", "decimals": 3},
        "modbus_registers": {"port": "p", "map": str(channels), "rate": 1.0},
        "nortek_nmea": {"port": "p", "rate": 4.0},
        "keller": {"port": "p"},
        "roboteq": {"port": "p", "nominal_bus_voltage": 48.0, "watchdog_timeout": 0.5, "rotation": "none"},
        "can_signals": {"bus": "b", "map": str(signals)},
        "scpi_supply": {"port": "p", "max_voltage": 24.0, "current_limit": 5.0},
        "dronecan_esc": {
            "bus": "b",
            "node_id": 42,
            "max_voltage": 24.0,
            "full_voltage": 48.0,
            "watchdog_timeout": 0.5,
        },
        "odrive_can": {
            "bus": "b",
            "node_id": 3,
            "max_voltage": 24.0,
            "watchdog_timeout": 0.5,
            "rate_per_volt": 1.0,
        },
        "smc_g2": {"port": "p", "nominal_bus_voltage": 48.0, "watchdog_timeout": 0.5},
        "vesc_uart": {"port": "p", "pole_pairs": 7, "nominal_bus_voltage": 48.0, "watchdog_timeout": 0.5},
        "vesc_can": {"bus": "b", "vesc_id": 1, "pole_pairs": 7, "nominal_bus_voltage": 48.0, "watchdog_timeout": 0.5},
        "cia402": {"bus": "b", "node_id": 5, "max_voltage": 24.0, "watchdog_timeout": 0.5, "rate_per_volt": 1.0},
        "cia401": {"bus": "b", "node_id": 7, "watchdog_timeout": 0.5},
        "cia404": {"bus": "b", "node_id": 6, "rate": 100.0},
    }
    assert set(options) == set(KINDS)
    for name, kind in KINDS.items():
        bus = (CanBus("virtual", "x", 1),) if kind.link == "can" else ()
        device = kind.build(name, kind.options(**options[name]), *bus)
        assert isinstance(device, Instrument)
        assert isinstance(device, MotorController) == (
            name
            in (
                "cia401",
                "cia402",
                "maestro",
                "dronecan_esc",
                "odrive_can",
                "roboteq",
                "scpi_supply",
                "smc_g2",
                "vesc_can",
                "vesc_uart",
            )
        )
        assert device.drain() == []
        assert not device.health().alive
        device.close()
