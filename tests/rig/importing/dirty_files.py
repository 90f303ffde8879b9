"""Ten dirty files as laboratories make them, each with the map and the options that its engineer would give.

`python -m tests.rig.importing.dirty_files FOLDER` makes them there and prints what `rig import` says of each.
"""

import subprocess
import sys
import zipfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

UNITS = """about = "ESC log of a bollard in the units of its instruments"
kind = "bollard"
[file]
delimiter = ";"
decimal = ","
[time]
column = "t (ms)"
unit = "ms"
[parameters]
pulse_stop = 1500
pulse_span = 400
[streams.esc.channels.command_voltage]
quantity = "command_voltage"
unit = "us"
column = "PWM"
[streams.esc.channels.rotation_rate]
quantity = "rotation_rate"
unit = "rpm"
column = "speed"
[streams.esc.channels.current]
quantity = "current"
unit = "header"
column = "I (mA)"
[streams.cell.channels.thrust]
quantity = "thrust"
unit = "lbf"
column = "Load"
[streams.cell.channels.torque]
quantity = "torque"
unit = "lbf·in"
column = "Torque"
[streams.water.channels.water_temperature]
quantity = "water_temperature"
unit = "°F"
column = "water"
"""
TABLE = """about = "volts, newtons and a time"
kind = "bollard"
[time]
column = "t"
[streams.table.channels.command_voltage]
quantity = "command_voltage"
unit = "V"
column = "U"
[streams.table.channels.thrust]
quantity = "thrust"
unit = "N"
column = "F"
"""
CELL = """about = "cell alone"
[time]
column = "t"
[streams.cell.channels.thrust]
quantity = "thrust"
unit = "gf"
column = "Load (gf)"
"""
DRIVE = """about = "drive alone"
[time]
column = "stamp"
unit = "ms"
[streams.drive.channels.command_voltage]
quantity = "command_voltage"
unit = "% duty"
column = "duty"
"""
LEVELS = np.array([0.0, 3.0, 7.0, 12.0, 5.0, -4.0, -10.0, 8.0, -6.0, 0.0])


def thrust_of(volts: np.ndarray) -> np.ndarray:
    return np.where(volts > 0, 0.4, 0.3) * volts * np.abs(volts)


def in_units(folder: Path) -> list[str]:
    lines = ["t (ms);PWM;speed;I (mA);Load;Torque;water"]
    for k in range(200):
        pulse = 1500 + 40 * (k // 20)
        volts = (pulse - 1500) / 400 * 16
        load = f"{0.2 * volts**2 / 4.4482216152605:.4f}".replace(".", ",")
        lines.append(f"{100 * k};{pulse};{90 * volts:.0f};{500 * volts:.0f};{load};1,5;68,0")
    (folder / "T3_bollard.csv").write_text("\n".join(lines) + "\n")
    (folder / "esc.toml").write_text(UNITS, encoding="utf-8")
    return ["T3_bollard.csv", "--map", "esc.toml"]


def in_units_with_supply(folder: Path) -> list[str]:
    return [*in_units(folder), "--set", "nominal_voltage=16"]


def in_an_unknown_unit(folder: Path) -> list[str]:
    in_units(folder)
    (folder / "counts.toml").write_text(UNITS.replace('unit = "lbf"\n', 'unit = "counts"\n'), encoding="utf-8")
    return ["T3_bollard.csv", "--map", "counts.toml"]


def level_table(folder: Path) -> list[str]:
    """Levels that rise steadily, ten seconds apart: it may as well be a slow ramp."""
    rows = [
        f"{10 * k},{v:g},{f:.2f}" for k, (v, f) in enumerate((v, thrust_of(v)) for v in np.arange(-10.0, 11.0, 2.0))
    ]
    (folder / "T2_levels.csv").write_text("\n".join(["t,U,F", *rows]) + "\n")
    (folder / "table.toml").write_text(TABLE)
    return ["T2_levels.csv", "--map", "table.toml"]


def level_table_told(folder: Path) -> list[str]:
    return [*level_table(folder), "--levels", "end"]


def with_tares_between(folder: Path) -> list[str]:
    """A phase column, and rows of the tare that must not be fitted; the cell reads the other way round."""
    rows = []
    for k in range(300):
        running = k % 100 >= 30
        volts = float(LEVELS[k // 30]) if running else 0.0
        rows.append(f"{0.05 * k:.2f},{'run' if running else 'tare'},{volts:g},{-float(thrust_of(np.array(volts))):.2f}")
    (folder / "run-07.csv").write_text("\n".join(["t,phase,U,F", *rows]) + "\n")
    (folder / "table.toml").write_text(TABLE)
    return ["run-07.csv", "--map", "table.toml", "--where", "phase == 'run'", "--thruster", "T1"]


def two_clocks(folder: Path) -> list[str]:
    """A cell at 50 Hz from its own start, and a drive that counts ms from when it was switched on, 7.4 s earlier."""
    rng = np.random.default_rng(4)
    t = np.arange(0, 4.0 * LEVELS.size, 0.02)
    force = thrust_of(LEVELS[(t // 4.0).astype(int)]) + rng.normal(0, 0.3, t.size)
    cell = [f"{now:.2f},{value / 9.80665 * 1000:.1f}" for now, value in zip(t, force, strict=True)]
    (folder / "T1_cell.csv").write_text("\n".join(["t,Load (gf)", *cell]) + "\n")
    at = np.arange(-7.4, t[-1], 0.1)
    duty = np.where(at < 0, 0.0, LEVELS[np.clip((at // 4.0).astype(int), 0, LEVELS.size - 1)] / 0.16)
    drive = [f"{1000 * (now + 7.4):.0f},{value:.2f}" for now, value in zip(at, duty, strict=True)]
    (folder / "drive.csv").write_text("\n".join(["stamp,duty", *drive]) + "\n")
    (folder / "cell.toml").write_text(CELL)
    (folder / "drive.toml").write_text(DRIVE)
    options = ["--with", "drive.csv", "--with-map", "drive.toml", "--set", "nominal_voltage=16"]
    return ["T1_cell.csv", "--map", "cell.toml", *options]


def two_clocks_of_a_sine(folder: Path) -> list[str]:
    """A sine fits itself at every period."""
    arguments = two_clocks(folder)
    t = np.arange(0, 100, 0.1)
    volts = 10 * np.sin(2 * np.pi * t / 20)
    cell = [f"{now:.1f},{value / 9.80665 * 1000:.1f}" for now, value in zip(t, thrust_of(volts), strict=True)]
    drive = [f"{1000 * (now + 3):.0f},{value / 0.16:.3f}" for now, value in zip(t, volts, strict=True)]
    (folder / "T1_cell.csv").write_text("\n".join(["t,Load (gf)", *cell]) + "\n")
    (folder / "drive.csv").write_text("\n".join(["stamp,duty", *drive]) + "\n")
    return arguments


def workbook(folder: Path) -> list[str]:
    """An Excel workbook by its bytes, with the name of a CSV, as a browser saved it."""
    with zipfile.ZipFile(folder / "T1_sheet.csv", "w") as file:
        file.writestr("[Content_Types].xml", "<Types/>")
        file.writestr("xl/workbook.xml", "<workbook/>")
    (folder / "table.toml").write_text(TABLE)
    return ["T1_sheet.csv", "--map", "table.toml"]


def matlab(folder: Path) -> list[str]:
    (folder / "T1.mat").write_bytes(b"MATLAB 5.0 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x01IM" + bytes(64))
    (folder / "table.toml").write_text(TABLE)
    return ["T1.mat", "--map", "table.toml"]


def bag(folder: Path) -> list[str]:
    (folder / "T1.bag").write_bytes(b"#ROSBAG V2.0\nE\x00\x00\x00\x10\x00\x00\x00" + bytes(64))
    (folder / "table.toml").write_text(TABLE)
    return ["T1.bag", "--map", "table.toml"]


def nobodys(folder: Path) -> list[str]:
    """The header says pounds, the map newtons; and whose run it is stands nowhere."""
    rows = [f"{0.1 * k:.1f},{k // 20},{0.1 * (k // 20) ** 2:.3f}" for k in range(100)]
    (folder / "monday_afternoon.csv").write_text("\n".join(["t,U,F [lbf]", *rows]) + "\n")
    (folder / "bracket.toml").write_text(TABLE.replace('column = "F"', 'column = "F [lbf]"'))
    return ["monday_afternoon.csv", "--map", "bracket.toml"]


def in_another_unit_than_the_map(folder: Path) -> list[str]:
    return [*nobodys(folder), "--thruster", "T1"]


FILES = (in_units, in_units_with_supply, in_an_unknown_unit, level_table, level_table_told, with_tares_between)
FILES += (two_clocks, two_clocks_of_a_sine, workbook, matlab, bag, nobodys, in_another_unit_than_the_map)


def told(folder: Path) -> Iterator[str]:
    """The command and what it prints, of each file in a folder of its own."""
    start = "import sys; from rig.cli import main; sys.exit(main())"
    for make in FILES:
        place = folder / make.__name__
        place.mkdir(parents=True)
        arguments = make(place)
        found = subprocess.run(
            [sys.executable, "-c", start, "import", *arguments], cwd=place, capture_output=True, text=True, check=False
        )
        yield f"$ rig import {' '.join(arguments)}\n{found.stdout}{found.stderr}exit status {found.returncode}\n"


if __name__ == "__main__":
    for text in told(Path(sys.argv[1])):
        sys.stdout.write(text + "\n")
