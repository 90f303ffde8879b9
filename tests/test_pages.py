"""How-to pages that list keys, words and examples: all that the code has, with the defaults that it has."""

from __future__ import annotations

import ast
import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any

import pytest
from textual.binding import Binding

from drivers import KINDS
from rig.campaign.config import (
    BenchConfig,
    CalibrationConfig,
    CampaignConfig,
    CanBusConfig,
    LimitConfig,
    MountConfig,
    WatchConfig,
)
from rig.campaign.loading import BENCH_ELSEWHERE, CAMPAIGN_ELSEWHERE, DWELLS, PLAN_ELSEWHERE
from rig.campaign.plan import Plan, TareConfig
from rig.campaign.shapes import SHAPES
from rig.campaign.waits import CoolDown
from rig.cli import main
from rig.console.app import STOP_KEYS, ConsoleApp
from rig.console.dialogs import LeaveDialog, NoteDialog
from rig.console.view_model.bench_text import DEVICE_STYLES
from rig.console.view_model.tables import STATE_STYLES
from rig.console.view_model.wording import STATE_WORDS
from rig.operate.check import check_campaign
from sim_devices import __main__ as simulator
from sim_devices.bench import control
from sim_devices.bench.settings import KEYS, CanBus, ScriptedFault, load
from sim_devices.bench.settings import KINDS as SIMULATED
from sim_devices.instruments import button, can_signals
from sim_devices.instruments.canopen import cell as canopen_cell
from sim_devices.instruments.canopen import drive as canopen_drive
from sim_devices.instruments.canopen import output as canopen_output
from sim_devices.instruments.dronecan import esc as dronecan
from sim_devices.instruments.modbus import cell as modbus_cell
from sim_devices.instruments.modbus import keller, pzem, registers_device
from sim_devices.instruments.odrive import axis as odrive
from sim_devices.instruments.pololu import maestro, smc
from sim_devices.instruments.roboteq import controller as roboteq
from sim_devices.instruments.scpi import supply as scpi_supply
from sim_devices.instruments.serial_lines import hbm_aed, line_sender, loadstar, mantracourt, mt_sics, nortek, sartorius
from sim_devices.instruments.vesc import controller as vesc
from sim_devices.vehicle.body import AXES, Body
from sim_devices.vehicle.settings import Noise as VehicleNoise
from sim_devices.vehicle.settings import Scalars
from sim_devices.wires.serial_line import DEFAULT_AMOUNT, WIRE_FAULTS
from sim_devices.world.effects import EFFECTS
from sim_devices.world.effects.channel import KINDS as LIES
from sim_devices.world.effects.uncatalogued import UNCATALOGUED
from sim_devices.world.noise import CHANNELS, Noise
from sim_devices.world.settings import Cell, Supply, Thruster, Tunnel

ROOT = Path(__file__).parents[1]
HOWTO = ROOT / "docs" / "howto"
NEW = ("campaign", "console", "console-in-a-browser", "simulated-bench", "json", "catalogue")
HEADER = '[campaign]\nname = "page"\nbench = "bench.toml"\nthrusters = ["T1"]\noutput = "recordings"\n'
FENCED = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
TABLES = (
    ("`[bench]`", BenchConfig, BENCH_ELSEWHERE),
    ("`[can.<name>]`", CanBusConfig, ()),
    ('`[limits."<stream>.<channel>"]`', LimitConfig, ("channel",)),
    ("`[mount]`", MountConfig, ()),
    ("`[calibration.<device>]`", CalibrationConfig, ()),
    ("`[campaign]`", CampaignConfig, tuple(name for name in CAMPAIGN_ELSEWHERE if name != "bench")),
    ("`[tare]`", TareConfig, ()),
    ("`[plan]`", Plan, PLAN_ELSEWHERE),
    ("`[plan.cool_down]`", CoolDown, ()),
    ("`[watch]`", WatchConfig, ()),
    *((f"`{kind}`:", found.options, ()) for kind, found in KINDS.items()),
    *((f"`{kind}`:", SHAPES[kind], ()) for kind in ("staircase", "levels", "ramp", "sine")),
)
"""Heading in campaign.md, dataclass, fields that are no keys there."""
IN_WORDS = {("LimitConfig", "max_age"), ("LimitConfig", "max_frozen"), ("Staircase", "min")}
"""Defaults of None that stand for something else, which the page says."""


def text(page: str) -> str:
    return (HOWTO / f"{page}.md").read_text(encoding="utf-8")


def words(body: str) -> set[str]:
    """What stands between backticks outside blocks of code."""
    return set(re.findall(r"`([^`\n]+)`", FENCED.sub("", body).replace(r"\|", "|")))


def section(heading: str) -> str:
    """Of campaign.md, from the heading that holds these words to the next."""
    parts = re.split(r"^(#+ .+)$", FENCED.sub("", text("campaign")), flags=re.MULTILINE)
    (found,) = [body for head, body in zip(parts[1::2], parts[2::2], strict=True) if heading in head]
    return found


def rows(body: str) -> Iterator[list[str]]:
    """Cells of the table rows."""
    for line in body.splitlines():
        if line.startswith("| "):
            yield [cell.strip().replace(r"\|", "|") for cell in re.split(r"(?<!\\)\|", line)[1:-1]]


def row_of(body: str, word: str) -> str:
    """The one row whose first cell has the word."""
    (found,) = ["|".join(row) for row in rows(body) if f"`{word}`" in row[0]]
    return found


def blocks(page: str) -> list[str]:
    return [body for language, body in FENCED.findall(text(page)) if language == "toml"]


def said(default: Any) -> str:
    """A default as TOML, in backticks; None as a word."""
    if default is None:
        return "none"
    return f"`{json.dumps([] if default == () else default)}`"


def test_blocks_and_words_are_told_apart() -> None:
    assert words("`a`, `b c`\n```toml\n`d`\n```\n`e|f`") == {"a", "b c", "e|f"}


@pytest.mark.parametrize(("heading", "cls", "elsewhere"), TABLES, ids=[table[0] for table in TABLES])
def test_every_key_of_the_files_with_its_default(heading: str, cls: type[Any], elsewhere: Sequence[str]) -> None:
    defaults = {name: row[1] for row in rows(section(heading)) for name in re.findall(r"`([^`]+)`", row[0])}
    for field in fields(cls):
        if field.name in elsewhere:
            continue
        if field.default is MISSING:
            assert defaults[field.name] == "required"
        elif field.default_factory is MISSING and (cls.__name__, field.name) not in IN_WORDS:
            assert defaults[field.name] == said(field.default), field.name


def test_every_plan_kind_and_dwell() -> None:
    for kind, shape in SHAPES.items():
        assert {field.name for field in fields(shape)} <= words(section(f"`{kind}`:")), kind
    dwells = words(section("`[plan.dwell]`"))
    for kind, dwell in DWELLS.items():
        assert {kind, *(field.name for field in fields(dwell))} <= dwells


def test_placeholders_of_the_mount_command() -> None:
    named = tuple(sorted(word for word in words(section("`[mount]`")) if word.startswith("{")))
    assert {"T1", "/b"} < set(MountConfig(named).words("T1", Path("/b")))
    assert len(named) == 3


@pytest.fixture
def own(tmp_path: Path) -> Path:
    """The bench and the campaign of the page as files, their ports on /dev/null."""
    for block in blocks("campaign"):
        if name := re.match(r"# (\w+\.toml)\n", block):
            (tmp_path / name[1]).write_text(re.sub(r'"/dev/[^"]+"', '"/dev/null"', block), encoding="utf-8")
    assert {path.name for path in tmp_path.iterdir()} == {"bench.toml", "campaign.toml"}
    return tmp_path


def test_the_own_bench_and_campaign_pass_the_check(own: Path) -> None:
    report = check_campaign(own / "campaign.toml")
    assert report.peak_thrust is not None


def test_the_plans_of_the_page_pass_the_check(own: Path) -> None:
    plans = [block for block in blocks("campaign") if block.startswith("[plan]\n")]
    for plan in plans:
        (own / "plan.toml").write_text(HEADER + plan, encoding="utf-8")
        check_campaign(own / "plan.toml")
    assert len(plans) >= len(SHAPES) - 1
    overrides = [block for block in blocks("campaign") if block.startswith("[overrides]\n")]
    assert len(plans) + len(overrides) + 2 == len(blocks("campaign"))


def test_the_error_of_the_page_is_what_the_tool_prints(
    own: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    campaign = own / "campaign.toml"
    campaign.write_text(campaign.read_text(encoding="utf-8").replace("levels", "levls"), encoding="utf-8")
    monkeypatch.chdir(own)
    assert main(["check", "campaign.toml"]) == 2
    assert capsys.readouterr().err in text("campaign")


def test_every_key_of_the_console() -> None:
    seen = {word.lower() for word in words(text("console"))}
    bound = [*STOP_KEYS]
    for binding in (*ConsoleApp.BINDINGS, *NoteDialog.BINDINGS, *LeaveDialog.BINDINGS):
        bound += (binding.key if isinstance(binding, Binding) else binding[0]).split(",")
    assert len(bound) > 15
    assert set(bound) <= seen


def test_every_state_of_the_console() -> None:
    assert {*STATE_WORDS.values(), *STATE_STYLES, *DEVICE_STYLES} <= words(text("console"))


def test_every_fault_and_command_of_the_simulated_bench() -> None:
    page = text("simulated-bench")
    for kind, device in (
        ("mt_sics", mt_sics.MtSics),
        ("hbm_aed", hbm_aed.HbmAed),
        ("loadstar", loadstar.Loadstar),
        ("pzem", pzem.Pzem),
        ("maestro", maestro.Maestro),
        ("smc_g2", smc.SmcG2),
        ("mantracourt_dsc", mantracourt.Mantracourt),
        ("sartorius_sbi", sartorius.Sartorius),
        ("line", line_sender.LineSender),
        ("modbus_cell", modbus_cell.ModbusCell),
        ("modbus_registers", registers_device.RegistersDevice),
        ("can_signals", can_signals.CanSender),
        ("button", button.Button),
        ("nortek", nortek.Nortek),
        ("keller", keller.Keller),
        ("dronecan_esc", dronecan.DronecanEsc),
        ("odrive", odrive.ODriveAxis),
        ("scpi_supply", scpi_supply.ScpiSupply),
        ("roboteq", roboteq.Roboteq),
        ("cia402", canopen_drive.Drive402),
        ("cia401", canopen_output.Output401),
        ("cia404", canopen_cell.Cell404),
        ("vesc", vesc.Vesc),
        ("vesc_uart", vesc.Vesc),
    ):
        (table,) = [part for part in page.split("\n\n") if part.startswith("| fault of") and f"(`{kind}`)" in part]
        assert set(device.faults) <= words(table)
    (wire,) = [part for part in page.split("\n\n") if part.startswith("| fault of a wire")]
    assert words(wire) == {"pulled", *WIRE_FAULTS}
    assert f"({DEFAULT_AMOUNT:g} when not given)" in wire
    shown = {word.split()[0] for word in words(page)}
    assert set(simulator.main.commands) <= shown
    assert control.__doc__ is not None
    assert set(re.findall(r"^([a-z]+) ", control.__doc__.partition("\n\n")[2], re.MULTILINE)) <= shown


def test_every_key_of_the_world_file() -> None:
    page = text("simulated-bench")
    seen = {name for word in words(page) for name in re.findall(r"[A-Za-z_0-9]+", word)}
    assert {*KEYS, "twin"} <= seen
    for cls in (Thruster, Tunnel, Supply, Cell, Noise, CanBus, ScriptedFault, Scalars, Body, VehicleNoise):
        assert {field.name for field in fields(cls)} <= seen, cls
    assert {*CHANNELS, *AXES} <= seen
    devices = page.partition("| `kind` in `[devices.<name>]`")[2].partition("\n\n")[0]
    for kind, options in SIMULATED.items():
        assert {field.name for field in fields(options)} - {"kind"} <= words(row_of(devices, kind)), kind


def test_every_effect_of_the_simulated_world_with_its_keys() -> None:
    tables = text("simulated-bench").partition("## Effects")[2]
    effects: dict[str, type[Any]] = {**EFFECTS, **UNCATALOGUED}
    for effect, cls in effects.items():
        row = row_of(tables, effect)
        same = row_of(tables, "command_saturation") if "`command_saturation`" in row else ""
        for field in fields(cls):
            if field.init:
                assert field.name in words(row + same), (effect, field.name)
            if field.init and isinstance(field.default, float) and field.default:
                assert re.search(rf"`{field.name}` {field.default:g}\b", row), (effect, field.name)
    assert set(LIES) <= words(row_of(tables, "channel_fault"))


def test_the_examples_of_the_world_file_load(tmp_path: Path) -> None:
    world = (ROOT / "benches" / "simulated" / "world.toml").read_text(encoding="utf-8")
    for block in blocks("simulated-bench"):
        (tmp_path / "world.toml").write_text(f"{world}\n{block}", encoding="utf-8")
        made = load(tmp_path / "world.toml")
        assert made.faults or made.world.effects


def test_every_key_of_the_json() -> None:
    """The keys of all dictionaries that the modules write which make the JSON."""
    seen = words(text("json"))
    for module in ("fit/as_json", "fit/one_pass_text", "vehicle/text", "design/text", "design/inertia"):
        tree = ast.parse((ROOT / "rig" / f"{module}.py").read_text(encoding="utf-8"))
        made = {
            key.value
            for node in ast.walk(tree)
            if isinstance(node, ast.Dict)
            for key in node.keys
            if isinstance(key, ast.Constant)
        }
        assert len(made) > 10
        assert made <= seen, (module, made - seen)


def anchor(heading: str) -> str:
    """As the forges make it."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


@pytest.mark.parametrize("path", [ROOT / "README.md", *(HOWTO / f"{page}.md" for page in NEW)], ids=lambda p: p.stem)
def test_links_lead_somewhere(path: Path) -> None:
    for link in re.findall(r"\]\(([^)]+)\)", path.read_text(encoding="utf-8")):
        if "://" in link:
            continue
        file, _, place = link.partition("#")
        target = (path.parent / file).resolve() if file else path
        assert target.exists(), link
        if place:
            headings = re.findall(r"^#+ (.+)$", target.read_text(encoding="utf-8"), re.MULTILINE)
            assert place in [anchor(heading) for heading in headings], link
