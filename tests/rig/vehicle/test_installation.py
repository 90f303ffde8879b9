"""The installation file: what it says, and the sentence for each thing that is wrong with it."""

import json

import numpy as np
import pytest

from rig.errors import ConfigError
from rig.vehicle.installation import load_installation
from rig.vehicle.thrusters import installed, read_fits
from tests.rig.vehicle_files import LAY_OUT, fit_of, write

BARE = "[thrusters]\nT1 = { surge = 1.0 }\nT2 = { surge = 1.0 }\n"


def loaded(tmp_path, text):
    path = tmp_path / "installation.toml"
    path.write_text(text)
    return load_installation(path)


def test_thrusters_share_the_gain_of_their_cell(tmp_path):
    fits = read_fits([fit_of(tmp_path / "fit.json")])
    found = installed(loaded(tmp_path, LAY_OUT), fits)
    assert found.names == ("C[T1]", "C[T2]", "C[T3]", "C[T4]")
    assert found.cov[0, 1] == pytest.approx(0.0017**2)
    assert found.cov[0, 0] == pytest.approx(0.0017**2 + 0.001**2)
    assert found.etas == ("eta_hull", "eta_pair")
    assert [(one.direction, one.thrusters) for one in found.interactions][:2] == [(1, ("T3", "T4")), (-1, ("T1", "T2"))]


def test_two_coefficients_of_one_fit_keep_their_covariance(tmp_path):
    path = fit_of(tmp_path / "fit.json", ("T1", "T2"), model="C+/C-")
    document = json.loads(path.read_text())
    scatter = [[2e-6, -1e-6, 7e-4], [-1e-6, 3e-6, -7e-4], [7e-4, -7e-4, 1.0]]
    names = ["C_plus", "C_minus", "tare[a]"]
    document["fits"][0]["covariance"] = {"names": names, "matrix": scatter, "statistical": scatter}
    path.write_text(json.dumps(document))
    found = installed(loaded(tmp_path, BARE), read_fits([path]))
    assert found.cov - 0.0017**2 == pytest.approx(np.array(
        [[2e-6, -1e-6, 0, 0], [-1e-6, 3e-6, 0, 0], [0, 0, 1e-6, 0], [0, 0, 0, 1e-6]]
    ))  # fmt: skip


def test_a_thruster_by_another_name_a_stated_one_a_table_and_a_curve(tmp_path):
    levels = [-1.0, 0.0, 1.0]
    steps = [
        {"phase": "hold", "command_voltage": V, "t_start": i * 4.0, "t_end": i * 4.0 + 4} for i, V in enumerate(levels)
    ]
    command = {
        "time": [0.0, 4.0, 8.0],
        "channels": {"u": {"quantity": "command_voltage", "unit": "V", "value": levels}},
    }
    cell = {
        "time": [1.0, 2.0, 5.0, 9.0, 10.0],
        "channels": {"F": {"quantity": "thrust", "unit": "N", "value": [-5.0, -7.0, 0.0, 19.0, None]}},
    }
    document = {
        "format": "thruster-rig-recording", "format_version": 1, "attributes": {"kind": "bollard"},
        "streams": {"command": command, "cell": cell}, "steps": steps,
    }  # fmt: skip
    write(tmp_path, "curve", document)
    text = (
        '[thrusters]\nA = { surge = 1.0, fit = "T1" }\nB = { yaw = 0.5, C = 0.3, C_std = 0.01 }\n'
        'D = { heave = 1.0, table = [[-1.0, -2.0], [1.0, 4.0]] }\nE = { sway = 1.0, curve = "curve.h5" }\n'
    )
    found = installed(loaded(tmp_path, text), read_fits([fit_of(tmp_path / "fit.json")]))
    a, b, d, e = found.thrusters
    assert a.coefficients.tolist() == [0.4]
    assert b.arms == {"yaw": 0.5}
    assert found.cov[1, 1] == pytest.approx(1e-4)
    assert d.levels.tolist() == [-1.0, 1.0]
    assert e.coefficients.tolist() == [-6.0, 0.0, 19.0]
    assert np.all(found.cov[2:, 2:] == 0)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[thrustes]\n", "did you mean thrusters?"),
        ("[thrusters]\n", "[thrusters] is empty"),
        ("[vehicle]\nname = 'x'\n", "missing table [thrusters]"),
        ("[thrusters]\nT1 = { serge = 1.0 }\n", "did you mean thrusters.T1.surge?"),
        ("[thrusters]\nT1 = { surge = 0.0 }\n", "pushes along no axis"),
        ("[thrusters]\nT1 = { surge = 1.0, C = 0.4, fit = 'T2' }\n", "takes one of fit, C, curve and table"),
        ("[thrusters]\nT1 = { surge = 1.0, C = 0.4, C_std = -1.0 }\n", "C_std not negative"),
        ("[thrusters]\nT1 = { surge = 1.0, table = [[1.0, 2.0]] }\n", "two or more pairs"),
        (BARE + "[efficiencies.eta]\n", "names no thruster"),
        (BARE + "[efficiencies.eta]\nalways = ['T3']\n", "efficiencies.eta.T3"),
        (BARE + "[efficiencies.k2]\nalways = ['T1']\n", "has the name of a parameter"),
        (BARE + "[efficiencies.eta]\npairs = [['T1', 'T2'], ['T2', 'T1']]\n", "twice"),
        (BARE + "[known.serge]\nm = { value = 1.0, std = 0.1 }\n", "did you mean known.surge?"),
        (BARE + "[known.surge]\nmass = { value = 1.0, std = 0.1 }\n", "known.surge.mass"),
        (BARE + "[known.surge]\nm = { value = 1.0, std = 0.0 }\n", "std a number above 0"),
        (BARE + "[trials.a]\nstep = 'still'\n", "trials.a.step must be"),
        ("not toml", "not valid TOML"),
    ],
)
def test_what_is_wrong_is_named(tmp_path, text, said):
    with pytest.raises(ConfigError) as caught:
        loaded(tmp_path, text)
    assert said in str(caught.value)


@pytest.mark.parametrize(
    ("document", "said"),
    [
        (None, "curve:"),
        (
            {"cell": {"time": [0.0], "channels": {"F": {"quantity": "thrust", "unit": "N", "value": [1.0]}}}},
            "no voltage",
        ),
        (
            {
                "cell": {"time": [0.0], "channels": {"F": {"quantity": "thrust", "unit": "N", "value": [1.0]}}},
                "u": {"time": [0.0], "channels": {"u": {"quantity": "command_voltage", "unit": "V", "value": [1.0]}}},
            },
            "1 level(s)",
        ),
    ],
)
def test_a_curve_that_is_none(tmp_path, document, said):
    if document is not None:
        write(tmp_path, "c", {"format": "thruster-rig-recording", "format_version": 1, "streams": document})
    file = loaded(tmp_path, '[thrusters]\nT1 = { surge = 1.0, curve = "c.h5" }\n')
    with pytest.raises(ConfigError) as caught:
        installed(file, {})
    assert said in str(caught.value)
