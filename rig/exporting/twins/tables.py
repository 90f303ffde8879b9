"""The curve as it is: a table for spreadsheets, and a C header that interpolates and checks itself."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rig.exporting.twins.curve import Floats
from rig.exporting.twins.written import CHECK_AT, Asked, Carried, hashed, head, put


def carried(asked: Asked) -> Carried:
    return Carried(asked.curve.at, lag=False)


def write_csv(asked: Asked, path: Path) -> None:
    curve = asked.curve
    columns: list[tuple[str, Floats]] = [
        (f"{curve.quantity} [{curve.unit}]", curve.driver),
        ("thrust [N]", curve.thrust),
        ("thrust_low [N]", curve.thrust - curve.half_width),
        ("thrust_high [N]", curve.thrust + curve.half_width),
    ]
    if curve.rate is not None:
        columns.append(("rotation_rate [rev/s]", curve.rate))
    rows = zip(*(values for _, values in columns), strict=True)
    put(
        path,
        [
            *hashed(head(asked, carried(asked))),
            ",".join(title for title, _ in columns),
            *(",".join(f"{value:.9g}" for value in row) for row in rows),
        ],
    )


def header_carried(asked: Asked) -> Carried:
    return Carried(asked.curve.at, lag=True)


def write_header(asked: Asked, path: Path) -> None:
    """C99, no library: a table, straight lines between, and the lag as a step of time."""
    curve, name, upper = asked.curve, asked.name, asked.name.upper()
    at = CHECK_AT * curve.largest
    wanted = float(curve.at(np.array([at]))[0])
    told = [f" * {line.replace('*/', '* /')}" for line in head(asked, header_carried(asked))]
    put(
        path,
        [
            "/*",
            *told,
            " */",
            f"#ifndef {upper}_THRUST_H",
            f"#define {upper}_THRUST_H",
            f"#define {upper}_POINTS {curve.driver.size}",
            f"#define {upper}_TIME_CONSTANT {curve.lag:.9g} /* s, of the input */",
            f"static const double {name}_input[{upper}_POINTS] = {{{_row(curve.driver)}}}; /* {curve.unit} */",
            f"static const double {name}_thrust_table[{upper}_POINTS] = {{{_row(curve.thrust)}}}; /* N */",
            f"static const double {name}_half_width[{upper}_POINTS] = {{{_row(curve.half_width)}}}; /* N, 95 % */",
            *_functions(name, upper),
            f"/* 1 where this file is read as it was written: {at:.6g} {curve.unit} -> {wanted:.6g} N */",
            f"static inline int {name}_self_check(void) {{",
            f"    double error = {name}_thrust({at:.17g}) - {wanted:.17g};",
            f"    return error < {1e-6 * max(abs(wanted), 1e-3):.3g} && error > -{1e-6 * max(abs(wanted), 1e-3):.3g};",
            "}",
            "#endif",
        ],
    )


def _row(values: Floats) -> str:
    return ", ".join(repr(float(value)) for value in values)


def _functions(name: str, upper: str) -> list[str]:
    return [
        "/* N, steady; level beyond the ends of the table */",
        f"static inline double {name}_thrust(double input) {{",
        "    int i = 1;",
        f"    if (!(input > {name}_input[0])) return {name}_thrust_table[0];",
        f"    if (!(input < {name}_input[{upper}_POINTS - 1])) return {name}_thrust_table[{upper}_POINTS - 1];",
        f"    while ({name}_input[i] < input) ++i;",
        f"    return {name}_thrust_table[i - 1] + (input - {name}_input[i - 1]) *",
        f"        ({name}_thrust_table[i] - {name}_thrust_table[i - 1]) / ({name}_input[i] - {name}_input[i - 1]);",
        "}",
        f"/* The lagging input after dt s at the command; begin with 0, and give the result to {name}_thrust */",
        f"static inline double {name}_lagging(double lagging, double command, double dt) {{",
        f"    double share = dt / ({upper}_TIME_CONSTANT + dt); /* backward Euler: stable at any dt */",
        "    return lagging + share * (command - lagging);",
        "}",
    ]
