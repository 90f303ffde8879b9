"""UUV Simulator, Plankton and DAVE (ROS 1): the thruster plugin's tables; and the thruster manager's parameters.

Sources: uuvsimulator/uuv_simulator at bfb40cb1, uuv_gazebo_ros_plugins/urdf/thruster_snippets.xacro; the manager of
Liquid-ai/Plankton at 47dab94c, which inverts its table by `numpy.interp(thrust, output, input)`.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rig.exporting.twins.curve import Curve, Floats
from rig.exporting.twins.written import LEAST_LAG, Asked, Carried, band_lines, hashed, head, numbers, put, xml_comment

RISE = 1e-6
"""N a point: a dead band is flat, and the inverse of what is flat is anything."""


def carried(asked: Asked) -> Carried:
    return Carried(asked.curve.at, lag=True)


def write(asked: Asked, path: Path) -> None:
    """The elements of the plugin that are the thruster's own."""
    curve = asked.curve
    low, high = float(np.min(curve.thrust)), float(np.max(curve.thrust))
    put(
        path,
        [
            *xml_comment([*head(asked, carried(asked)), *band_lines(curve)]),
            f'<plugin name="{asked.name}" filename="libuuv_thruster_ros_plugin.so">',
            "  <dynamics>",
            "    <type>FirstOrder</type>",
            f"    <timeConstant>{curve.lag or LEAST_LAG:.6g}</timeConstant>",
            "  </dynamics>",
            "  <conversion>",
            "    <type>LinearInterp</type>",
            f"    <inputValues>{numbers(curve.driver)}</inputValues>",
            f"    <outputValues>{numbers(curve.thrust)}</outputValues>",
            "  </conversion>",
            f"  <clampMin>{curve.driver[0]:.9g}</clampMin>",
            f"  <clampMax>{curve.driver[-1]:.9g}</clampMax>",
            f"  <thrustMin>{low:.9g}</thrustMin>",
            f"  <thrustMax>{high:.9g}</thrustMax>",
            "  <thrust_efficiency>1.0</thrust_efficiency>",
            "</plugin>",
        ],
    )


def rising(curve: Curve) -> Floats:
    """(POINTS,) N, strictly ascending: what falls is held, and what is flat rises by RISE a point."""
    out: Floats = np.maximum.accumulate(curve.thrust) + RISE * (np.arange(curve.driver.size) - curve.driver.size // 2)
    return out


def manager_carried(asked: Asked) -> Carried:
    """Of each thrust that is asked for, what the command of the inverted table gives."""
    curve, output = asked.curve, rising(asked.curve)
    return Carried(
        lambda u: curve.at(np.interp(curve.at(u), output, curve.driver)),
        lost=("the manager shares out forces by one max_thrust both ways: the smaller of the two",),
    )


def write_manager(asked: Asked, path: Path) -> None:
    """ROS 1: the parameters of uuv_thruster_manager."""
    put(path, [*_head(asked), *_manager(asked, "")])


def write_plankton(asked: Asked, path: Path) -> None:
    """ROS 2: the same below every node's parameters."""
    put(path, [*_head(asked), "/**:", "  ros__parameters:", *_manager(asked, "    ")])


def _head(asked: Asked) -> list[str]:
    return hashed([*head(asked, manager_carried(asked)), *band_lines(asked.curve)])


def _manager(asked: Asked, indent: str) -> list[str]:
    curve = asked.curve
    most = min(float(np.max(curve.thrust)), -float(np.min(curve.thrust)))
    lines = [
        "thruster_manager:",
        "  tf_prefix: rov",
        "  base_link: base_link",
        "  thruster_topic_prefix: thrusters/",
        "  thruster_topic_suffix: /input",
        "  thruster_frame_base: thruster_",
        f"  max_thrust: {most:.9g}",
        "  timeout: -1.0",
        "  update_rate: 50.0",
        "  conversion_fcn: custom",
        "  conversion_fcn_params:",
        f"    input: [{_floats(curve.driver)}]",
        f"    output: [{_floats(rising(curve))}]",
    ]
    return [indent + line for line in lines]


def _floats(values: Floats) -> str:
    """With a point and no exponent each: a list that mixes whole numbers and others is none to ROS 2, and YAML 1.1
    takes 2e-05 for text."""
    return ", ".join(f"{value:.9f}" for value in values)
