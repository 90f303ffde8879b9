"""Stonefish: an actuator whose thrust model is a table, with a first-order rotor.

Source: patrykcieslak/stonefish, docs/actuators.rst and Library/src/core/ScenarioParser.cpp at b21eb8e1. It clips the
set-point symmetrically, and interpolates the table by straight lines.
"""

from __future__ import annotations

from pathlib import Path

from rig.exporting.twins.written import LEAST_LAG, Asked, Carried, band_lines, head, numbers, put, xml_comment


def carried(asked: Asked) -> Carried:
    return Carried(asked.curve.at, lag=True)


def write(asked: Asked, path: Path) -> None:
    curve = asked.curve
    diameter = "" if asked.diameter is None else f'diameter="{asked.diameter:.6g}" '
    told = [] if asked.diameter is not None else ["The diameter of the propeller is not known here: --diameter"]
    put(
        path,
        [
            *xml_comment([*head(asked, carried(asked)), *told, *band_lines(curve)]),
            f'<actuator name="{asked.name}" type="thruster">',
            f'  <specs max_setpoint="{curve.largest:.9g}" inverted_setpoint="false" normalized_setpoint="false"/>',
            f'  <propeller {diameter}right="true"/>  <!-- its mesh and material are yours -->',
            '  <rotor_dynamics type="first_order">',
            f'    <time_constant value="{curve.lag or LEAST_LAG:.6g}"/>',
            "  </rotor_dynamics>",
            '  <thrust_model type="linear_interpolation">',
            f'    <input value="{numbers(curve.driver)}"/>',
            f'    <output value="{numbers(curve.thrust)}"/>',
            "  </thrust_model>",
            '  <origin xyz="0.0 0.0 0.0" rpy="0.0 0.0 0.0"/>  <!-- where it sits is yours -->',
            "</actuator>",
        ],
    )
