"""Files that are no tables of text: what they are, by their first bytes, and how a table is made of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, slots=True)
class Foreign:
    """A format that is no table of text."""

    starts: tuple[bytes, ...]
    suffixes: tuple[str, ...]
    """Decide where the first bytes alone do not; with the dot."""
    what: str
    do: str
    holds: bytes = b""
    """Bytes somewhere in the file that decide as well as a suffix."""
    kind: str = ""
    """Of [file] in a map that reads it; empty: none does."""


FORMATS: Final = (
    Foreign(
        (b"\x89HDF\r\n\x1a\n",),
        (".mat",),
        "a MATLAB file of version 7.3 (HDF5 inside)",
        "in MATLAB: load it, then writetable(table(t, command, thrust), 'run.csv')",
        kind="mat",
    ),
    Foreign(
        (b"\x89HDF\r\n\x1a\n",),
        (),
        "an HDF5 file",
        "if it is a recording (*.h5) it needs no import: rig fit FILE; otherwise write its datasets as CSV, in Python "
        "with h5py and numpy.savetxt",
    ),
    Foreign(
        (b"MATLAB 5.0 MAT-file",),
        (),
        "a MATLAB file (version 5 to 7.2)",
        "in MATLAB: load it, then writetable(table(t, command, thrust), 'run.csv'); in Python: scipy.io.loadmat and "
        "numpy.savetxt",
        kind="mat",
    ),
    Foreign(
        (b"#ROSBAG",),
        (),
        "a ROS 1 bag",
        "rostopic echo -b FILE -p /TOPIC > topic.csv, one file for each topic",
        kind="bag",
    ),
    Foreign(
        (b"\x89MCAP0\r\n",),
        (),
        "an MCAP log (ROS 2, Foxglove)",
        "export the topics as CSV in Foxglove or PlotJuggler, one file for each topic",
        kind="mcap",
    ),
    Foreign(
        (b"SQLite format 3\x00",),
        (".db3",),
        "a ROS 2 bag (SQLite inside)",
        "open the bag in PlotJuggler and export the topics as CSV, or ros2 topic echo --csv /TOPIC > topic.csv while "
        "ros2 bag play runs",
    ),
    Foreign(
        (b"SQLite format 3\x00",),
        (),
        "an SQLite database",
        "sqlite3 -header -csv FILE 'SELECT * FROM table' > run.csv",
    ),
    Foreign(
        (b"ULog\x01\x12\x35",),
        (),
        "a PX4 log (ULog)",
        "ulog2csv FILE (pip install pyulog) writes one CSV for each topic; time is `timestamp` in us",
        kind="ulog",
    ),
    Foreign(
        (b"\xa3\x95",),
        (".bin",),
        "an ArduPilot dataflash log",
        "mavlogdump.py --format csv --types RCOU FILE > rcou.csv (pip install pymavlink), a file for each message type",
        kind="dataflash",
    ),
    Foreign(
        (b"TDSm",),
        (),
        "a LabVIEW TDMS file",
        "open it in Excel with the TDMS add-in and save as CSV, or in Python: nptdms.TdmsFile(FILE).as_dataframe()"
        ".to_csv('run.csv')",
        kind="tdms",
    ),
    Foreign(
        (b"MDF     ", b"UnFinMF "),
        (),
        "a measurement file MDF/MF4 (ASAM)",
        "in Python: asammdf.MDF(FILE).export('csv', 'run'), or the same in the asammdf window",
        kind="mdf",
    ),
    Foreign(
        (b"PAR1",),
        (),
        "a Parquet table",
        "in Python: pandas.read_parquet(FILE).to_csv('run.csv', index=False)",
        kind="parquet",
    ),
    Foreign(
        (b"ARROW1", b"FEA1"),
        (),
        "an Arrow or Feather table",
        "in Python: pandas.read_feather(FILE).to_csv('run.csv', index=False)",
    ),
    Foreign(
        (b"PK\x03\x04",),
        (".xlsx", ".xlsm"),
        "an Excel workbook",
        "in Excel or LibreOffice: File > Save as > CSV, one file for each sheet (soffice --convert-to csv FILE)",
        b"xl/workbook.xml",
    ),
    Foreign(
        (b"PK\x03\x04",),
        (".ods",),
        "a LibreOffice spreadsheet",
        "File > Save as > Text CSV, one file for each sheet (soffice --convert-to csv FILE)",
    ),
    Foreign((b"PK\x03\x04",), (".npz",), "arrays of NumPy", "numpy.savetxt('run.csv', columns, delimiter=',')"),
    Foreign((b"PK\x03\x04",), (), "a ZIP archive", "unpack it and import the table inside"),
    Foreign(
        (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1",),
        (),
        "an old Excel workbook (.xls)",
        "in Excel or LibreOffice: File > Save as > CSV, one file for each sheet (soffice --convert-to csv FILE)",
    ),
    Foreign((b"\x93NUMPY",), (), "an array of NumPy", "numpy.savetxt('run.csv', numpy.load(FILE), delimiter=',')"),
    Foreign((b"\x1f\x8b",), (), "a file packed with gzip", "gunzip FILE, then import what is inside"),
    Foreign((b"%PDF",), (), "a PDF document", "ask for the table behind it; figures can't be imported"),
)
MULTIBYTE: Final = (b"\xff\xfe", b"\xfe\xff")
"""Byte-order marks of UTF-16, whose text holds zero bytes."""


def foreign(data: bytes, name: str, encoding: str = "utf-8") -> str:
    """What the file is and what to do, in one sentence; empty when it may be a table of text in `encoding`."""
    suffix = "." + name.rpartition(".")[2].lower()
    for one in FORMATS:
        decided = not one.suffixes or suffix in one.suffixes or (one.holds and one.holds in data)
        if data.startswith(one.starts) and decided:
            if one.kind:
                return f'this is {one.what}: say [file] kind = "{one.kind}" in the map. Or as text: {one.do}'
            return f"this is {one.what}, and rig import reads tables of text (CSV). Do: {one.do}; then import that"
    wide = data.startswith(MULTIBYTE) or encoding.lower().startswith(("utf-16", "utf-32"))
    if b"\x00" in data[:4096] and not wide:
        return (
            "this is a binary file of no kind that is known here, and rig import reads tables of text (CSV); export it "
            "as CSV with the program that wrote it"
        )
    return ""
