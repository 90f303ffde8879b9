"""The simulated bench runs on a saved model."""

from __future__ import annotations

import json

import numpy as np
import pytest

from rig.twin.reading import read_twin
from tests.rig.diagnose.diagnosed_files import with_line
from tests.rig.diagnose.in_the_world.acted_twins import SCALE, entry, file_of


def test_the_simulated_bench_runs_on_a_twin(dead, tmp_path):
    from sim_devices.bench.settings import load as load_world
    from sim_devices.world.headless import run as headless
    from sim_devices.world.noise import Noise

    twin = read_twin(dead[2])
    (tmp_path / "T1.twin.json").write_text(dead[2].read_text())
    world = tmp_path / "world.toml"
    world.write_text('twin = "T1.twin.json"\n[noise.thrust]\nwhite = 0.0\n')
    settings = load_world(world).world
    assert settings.mounted == "T1"
    assert settings.noise["thrust"] == Noise()
    out = headless(settings, [0.0, 1.0], [10.0, -6.0], 2.0, rates={"thrust": 50.0}, rng=np.random.default_rng(1))
    width = twin.terms[0].parameters["half_width"]
    assert out["thrust"].exact[25] == pytest.approx(twin.C * (10.0 - width) ** 2, rel=1e-6)
    assert out["thrust"].exact[-1] == pytest.approx(-twin.C * (6.0 - width) ** 2, rel=1e-6)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t: t["terms"][0].update(effect="rotation_coupling"), "cannot act the term 'rotation_coupling'"),
        (lambda t: t["terms"].append(t["terms"][0]), "is there twice"),
        (lambda t: t.update(driver="rotation_rate"), "commanded in volts"),
        (lambda t: t.pop("C"), "not as --save-twin writes it"),
        (lambda t: t.update(version=9), "is not a thruster-rig-twin of version 1 or 2"),
    ],
)
def test_a_twin_that_the_world_cannot_act_is_said(dead, tmp_path, change, words):
    from sim_devices.tables import WorldError
    from sim_devices.world.twin import with_twin

    content = json.loads(dead[2].read_text())
    change(content)
    (tmp_path / "it.json").write_text(json.dumps(content))
    with pytest.raises(WorldError, match=words):
        with_twin({"twin": "it.json"}, tmp_path)


def test_every_term_of_the_catalogue_that_the_world_knows_builds_its_effect():
    from identification.twin import TERMS
    from sim_devices.tables import WorldError
    from sim_devices.world import twin as world_twin
    from sim_devices.world.settings import make_effects

    left = []
    for (effect, form), term in TERMS.items():
        content = file_of(entry(effect, form, *term.trials(SCALE)[0]))
        try:
            make_effects(world_twin.world_of(content)[1])
        except WorldError:
            left.append((effect, form))
    assert set(left) == {
        ("heating", "measured_winding"),
        ("heating", "measured_magnet"),
        ("heating", "measured_winding_and_magnet"),
        ("heating", "measured_own_winding"),
        ("supply_sag", ""),
        ("supply_sag", "buffered"),
        ("supply_sag", "discharge"),
        ("supply_sag", "loaded"),
        ("motor_lag", "mixed"),
        ("motor_lag", "coasting"),
        ("load_cell_saturation", "averaged"),
        ("rotation_coupling", ""),
        ("thruster_interaction", ""),
        ("torque_crosstalk", "measured"),
        ("reversal_loss", "step"),
    }


RATIO = {"value": 3.001, "std": 0.001, "unit": "1/(rev)"}


def test_the_simulated_bench_has_the_line_or_says_that_it_cannot(dead, tmp_path):
    from sim_devices.tables import WorldError
    from sim_devices.world.twin import with_twin

    def effects(**line):
        path = with_line(tmp_path, dead, **line)
        return with_twin({"twin": path.name}, tmp_path)["effects"]["periodic_disturbance"]

    assert effects() == {"amplitude": 0.3, "frequency": 7.3, "phase": 1.0}
    force = {"growth": 2.0, "at_speed": 18.0, "phase": None}
    turning = effects(kind="rotation", ratio=RATIO, **force)
    per_volt = json.loads(dead[2].read_text())["rate_per_driver"] or 1.0
    assert turning == {"amplitude": 0.3, "blades": 3, "reference_voltage": pytest.approx(18.0 / per_volt)}
    by_volts = RATIO | {"value": 3.0 * per_volt}
    assert effects(kind="rotation", turns="V s", ratio=by_volts, **force)["reference_voltage"] == 18.0
    with pytest.raises(WorldError, match=r"2\.4 periods per turn; the world has whole numbers only"):
        effects(kind="rotation", ratio=RATIO | {"value": 2.4}, **force)
    with pytest.raises(WorldError, match=r"power 0 of its rate; those of the world grow with its square"):
        effects(kind="rotation", ratio=RATIO)
    path = with_line(tmp_path, dead)
    content = json.loads(path.read_text())
    path.write_text(json.dumps(content | {"lines": 2 * content["lines"]}))
    with pytest.raises(WorldError, match="2 periodic disturbances; the world has one at a time"):
        with_twin({"twin": path.name}, tmp_path)
