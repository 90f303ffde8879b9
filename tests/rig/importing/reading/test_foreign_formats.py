"""Files that are no text: told by their bytes, whatever their name, with what to do; text is never taken for one."""

import pytest

from rig.errors import RecordingError
from rig.importing.one_file import import_plain
from rig.importing.reading.foreign_formats import foreign

HDF = b"\x89HDF\r\n\x1a\n"


@pytest.mark.parametrize(
    ("name", "data", "what", "do"),
    [
        ("a.xlsx", b"PK\x03\x04....", "an Excel workbook", "Save as > CSV"),
        ("a.csv", b"PK\x03\x04..xl/workbook.xml", "an Excel workbook", "Save as > CSV"),
        ("a.xls", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1..", "an old Excel workbook", "Save as > CSV"),
        ("a.ods", b"PK\x03\x04....", "a LibreOffice spreadsheet", "Save as > Text CSV"),
        ("a.zip", b"PK\x03\x04....", "a ZIP archive", "unpack it"),
        ("a.mat", b"MATLAB 5.0 MAT-file, Platform", "a MATLAB file", "writetable"),
        ("a.mat", HDF, "a MATLAB file of version 7.3", "writetable"),
        ("a.h5", HDF, "an HDF5 file", "rig fit FILE"),
        ("a.bag", b"#ROSBAG V2.0\n", "a ROS 1 bag", "rostopic echo"),
        ("a.db3", b"SQLite format 3\x00", "a ROS 2 bag", "ros2 topic echo"),
        ("a.sqlite", b"SQLite format 3\x00", "an SQLite database", "sqlite3"),
        ("a.mcap", b"\x89MCAP0\r\n", "an MCAP log", "PlotJuggler"),
        ("a.ulg", b"ULog\x01\x12\x35\x01", "a PX4 log", "ulog2csv"),
        ("a.BIN", b"\xa3\x95\x80\x80", "an ArduPilot dataflash log", "mavlogdump.py"),
        ("a.tdms", b"TDSm\x0e\x00", "a LabVIEW TDMS file", "nptdms"),
        ("a.mf4", b"MDF     4.10", "a measurement file MDF", "asammdf"),
        ("a.parquet", b"PAR1\x15", "a Parquet table", "read_parquet"),
        ("a.npy", b"\x93NUMPY\x01", "an array of NumPy", "numpy.load"),
        ("a.gz", b"\x1f\x8b\x08", "a file packed with gzip", "gunzip"),
        ("a.pdf", b"%PDF-1.7", "a PDF document", "ask for the table"),
        ("a.dat", b"\x00\x01\x02", "a binary file of no kind that is known here", "export it as CSV"),
    ],
)
def test_what_it_is_and_what_to_do(name, data, what, do):
    said = foreign(data, name)
    assert f"this is {what}" in said
    assert do in said


@pytest.mark.parametrize(
    ("data", "encoding"),
    [
        (b"t,f\n0,1\n", "utf-8"),
        ("t,f\n0,1\n".encode("utf-16"), "utf-16"),
        ("t,f\n0,1\n".encode("utf-16-le"), "utf-16-le"),
        ("t,°\n".encode("latin-1"), "utf-8"),
        (b"", "utf-8"),
    ],
)
def test_text_is_text(data, encoding):
    assert foreign(data, "a.csv", encoding) == ""


def test_a_file_without_a_map_is_told_too(tmp_path):
    (tmp_path / "log.ulg").write_bytes(b"ULog\x01\x12\x35\x01")
    with pytest.raises(RecordingError, match=r"log\.ulg: this is a PX4 log .*ulog2csv log\.ulg"):
        import_plain(tmp_path / "log.ulg", tmp_path / "log.h5")
