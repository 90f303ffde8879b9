"""Files that a catalogue is about, as small as they can be, and the catalogue of a folder asked as the commands do."""

import json

import h5py

from rig.catalogue.index import with_index
from rig.catalogue.refresh import refresh
from rig.catalogue.selection import Filter, selected
from tests.rig.hdf5.plain_files import plain

GAIN = json.dumps({"gain_std": 0.001, "role": "primary"})
EVERYTHING = Filter()


def recording(path, identity="id-1", thruster="T1", created="2026-03-01T10:00:00+00:00", calibration=GAIN, **root):
    path.parent.mkdir(parents=True, exist_ok=True)
    said = {"recording_id": identity, "thruster": thruster, "created": created, "complete": True}
    plain(path, **(said | {"outcome": "completed"} | root))
    with h5py.File(path, "r+") as file:
        file["streams/cell/thrust"].attrs["calibration"] = calibration
    return path


def fit(path, thruster="T1", recordings=("id-1",), C=0.4, std=0.001, gain_std=0.0, calibration="", dof=20.0, **other):
    """A fit as `rig fit --json` writes it, of one thruster and one coefficient."""
    gain = gain_std * C
    whole = (std**2 + gain**2) ** 0.5
    parameter = {"value": C, "std": whole, "unit": "N/V^2", "std_statistical": std, "std_calibration": gain}
    entry = {
        "thruster": thruster,
        "recordings": list(recordings),
        "model": "C V|V|",
        "voltage": "command_voltage",
        "parameters": {"C": parameter | {"dof": dof * (whole / std) ** 4}},
        "rmse": 0.1,
        "covariance": {"names": ["C"], "statistical": [[std**2]]},
        "calibration": calibration,
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps({"format": "thruster-rig-fit", "version": 1, "fits": [entry | other]}))
    return path


def twin(path, thruster="T1", recordings=("id-1",)):
    sources = [{"recording_id": name, "sha256": "", "file": ""} for name in recordings]
    content = {"format": "thruster-rig-twin", "version": 1, "thruster": thruster, "C": 0.4, "driver": "command_voltage"}
    content |= {"terms": [{"effect": "dead_band"}], "recordings": sources, "created": "2026-03-05T00:00:00+00:00"}
    path.write_text(json.dumps(content))
    return path


def diagnosis(path, thruster="T1", recordings=("id-1",), verdict="explained"):
    content = {"format": "thruster-rig-diagnosis", "version": 1, "thruster": thruster, "verdict": verdict}
    content |= {
        "recordings": list(recordings),
        "headline": "a dead band of 0.8 V",
        "findings": [{"effect": "dead_band"}],
    }
    path.write_text(json.dumps(content))
    return path


def ledger(folder, runs=(("T1", "id-1", "completed"),), name="spring", end="completed"):
    """The ledger of a campaign; `end`: its outcome, empty while it goes on."""
    folder.mkdir(parents=True, exist_ok=True)
    thrusters = [thruster for thruster, _, _ in runs]
    start = {"fact": "start", "campaign": name, "thrusters": thrusters, "identities": {}, "campaign_file": "c.toml"}
    start |= {"campaign_sha256": "", "bench_sha256": "", "campaign_toml": "", "bench_toml": '[bench]\nname = "tank"\n'}
    facts = [start]
    for thruster, identity, outcome in runs:
        file = f"{folder}/{thruster}.h5"
        begun = {"fact": "run_start", "thruster": thruster, "recording": file, "recording_t0_ns": 0, "attempt": 1}
        facts.append(begun | {"recording_id": identity})
        ended = {"fact": "run_end", "thruster": thruster, "recording": file, "outcome": outcome, "cause": ""}
        facts += [ended | {"sha256": "", "time_to_zero_s": None}] if outcome else []
    facts += [{"fact": "end", "outcome": end, "cause": ""}] if end else []
    (folder / "campaign.jsonl").write_text("".join(json.dumps(fact) + "\n" for fact in facts))
    return folder


def asked(folder, wanted=EVERYTHING, cache=None, said=None):
    """What `rig list` would show; `said` gets what it says beside it."""

    def work(connection):
        refresh(connection, folder)
        return selected(connection, wanted)

    return with_index(folder, cache or folder / "cache", work, (said if said is not None else []).append)
