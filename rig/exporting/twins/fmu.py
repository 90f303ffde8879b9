"""An FMI 3.0 FMU for co-simulation, with its C source and, where this machine has a C compiler, a binary for it.

Source: Functional Mock-up Interface Specification 3.0.2, 2.2 (variables, units), 2.5 (archive: modelDescription.xml,
sources/buildDescription.xml, binaries/<platform tuple>/), 4.1 (co-simulation). No Python on the target.
"""

from __future__ import annotations

import platform
import shutil
import subprocess
import sys
import tempfile
import uuid
import zipfile
from datetime import UTC, datetime
from importlib.resources import files
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from rig.errors import TwinError
from rig.exporting.twins.written import CHECK_AT, Asked, Carried, head

MODEL = "thruster"
"""Model identifier: name of the binary, and prefix of nothing, as FMI 3.0 has it for a shared library."""
ENDINGS = {"linux": ".so", "darwin": ".dylib", "win32": ".dll"}
SYSTEMS = {"linux": "linux", "darwin": "darwin", "win32": "windows"}
MACHINES = {"x86_64": "x86_64", "AMD64": "x86_64", "aarch64": "aarch64", "arm64": "aarch64"}
COMPILE_TIME = 60.0
"""s at most."""
BASE_UNITS = {"V": 'kg="1" m="2" s="-3" A="-1"', "rev/s": 'rad="1" s="-1" factor="6.283185307179586"'}


def carried(asked: Asked) -> Carried:
    return Carried(asked.curve.at, lag=True)


def write(asked: Asked, path: Path) -> None:
    """Raises TwinError where a compiler is there and refuses."""
    token = "{" + str(uuid.uuid5(uuid.NAMESPACE_OID, repr(asked.twin))) + "}"
    source = _source(asked, token)
    binary = _compiled(source)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("modelDescription.xml", _description(asked, token))
        archive.writestr("sources/buildDescription.xml", BUILD)
        archive.writestr(f"sources/{MODEL}.c", source)
        archive.writestr("documentation/README.txt", "\n".join(head(asked, carried(asked))) + "\n")
        if binary is not None:
            archive.writestr(f"binaries/{_tuple()}/{MODEL}{ENDINGS[sys.platform]}", binary)


def _tuple() -> str:
    """Of this machine, as 2.5.1.4.1 names it."""
    return f"{MACHINES.get(platform.machine(), platform.machine())}-{SYSTEMS[sys.platform]}"


def _source(asked: Asked, token: str) -> str:
    curve = asked.curve
    place = {
        "@TOKEN@": token,
        "@POINTS@": str(curve.driver.size),
        "@INPUT@": ", ".join(repr(float(u)) for u in curve.driver),
        "@THRUST@": ", ".join(repr(float(t)) for t in curve.thrust),
        "@HALF_WIDTH@": ", ".join(repr(float(h)) for h in curve.half_width),
        "@TIME_CONSTANT@": repr(curve.lag),
    }
    text = files(__package__).joinpath("fmu_thruster.c").read_text(encoding="utf-8")
    for mark, value in place.items():
        text = text.replace(mark, value)
    return text


def _compiled(source: str) -> bytes | None:
    """For this machine; None where it has no C compiler."""
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None or sys.platform not in ENDINGS:
        return None
    with tempfile.TemporaryDirectory() as folder:
        place, made = Path(folder, f"{MODEL}.c"), Path(folder, MODEL + ENDINGS[sys.platform])
        place.write_text(source, encoding="utf-8")
        command = [compiler, "-std=c99", "-O2", "-shared", "-fPIC", "-o", str(made), str(place), "-lm"]
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=COMPILE_TIME, check=False)
        except (OSError, subprocess.TimeoutExpired) as error:
            raise TwinError(f"the C compiler {compiler} did not end: {error}") from error
        if done.returncode:
            raise TwinError(f"the C compiler {compiler} refused the FMU's source: {done.stderr.strip()[:300]}")
        return made.read_bytes()


BUILD = f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiBuildDescription fmiVersion="3.0">
  <BuildConfiguration modelIdentifier="{MODEL}">
    <SourceFileSet language="C99">
      <SourceFile name="{MODEL}.c"/>
    </SourceFileSet>
  </BuildConfiguration>
</fmiBuildDescription>
"""


def _description(asked: Asked, token: str) -> str:
    curve = asked.curve
    at = CHECK_AT * curve.largest
    half = float(np.interp(at, curve.driver, curve.half_width))
    about = quoteattr(" | ".join(head(asked, carried(asked))))
    now = datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName={quoteattr(asked.curve.thruster)} instantiationToken="{token}"
  description={about} generationTool="thruster-rig" generationDateAndTime="{now}" variableNamingConvention="flat">
  <CoSimulation modelIdentifier="{MODEL}" canHandleVariableCommunicationStepSize="true" canGetAndSetFMUState="false"
    canSerializeFMUState="false"/>
  <UnitDefinitions>
    <Unit name="N"><BaseUnit kg="1" m="1" s="-2"/></Unit>
    <Unit name="s"><BaseUnit s="1"/></Unit>
    <Unit name="{curve.unit}"><BaseUnit {BASE_UNITS[curve.unit]}/></Unit>
  </UnitDefinitions>
  <DefaultExperiment startTime="0" stepSize="0.01"/>
  <ModelVariables>
    <Float64 name="time" valueReference="0" causality="independent" variability="continuous"/>
    <Float64 name="input" valueReference="1" causality="input" variability="continuous" unit="{curve.unit}" start="0"
      description="{curve.quantity}"/>
    <Float64 name="thrust" valueReference="2" causality="output" variability="continuous" unit="N"/>
    <Float64 name="half_width" valueReference="3" causality="output" variability="continuous" unit="N"
      description="half of the 95 % interval of the steady thrust; {half:.4g} N at {at:.6g} {curve.unit}"/>
    <Float64 name="time_constant" valueReference="4" causality="parameter" variability="tunable" unit="s"
      start="{curve.lag!r}" min="0" description="first-order lag of the input"/>
    <Float64 name="efficiency" valueReference="5" causality="parameter" variability="tunable" start="1" min="0"
      description="of the thrust, once the thruster sits on the vehicle"/>
  </ModelVariables>
  <ModelStructure>
    <Output valueReference="2" dependencies="1"/>
    <Output valueReference="3" dependencies="1"/>
    <InitialUnknown valueReference="2" dependencies="1 4 5"/>
    <InitialUnknown valueReference="3" dependencies="1 5"/>
  </ModelStructure>
</fmiModelDescription>
"""
