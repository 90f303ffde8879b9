"""What `rig prove --beside` shows: its files as their programs write them, what is refused, page and JSON."""

import importlib.util
import json
import sys
from dataclasses import asdict, replace
from pathlib import Path

import pytest
from click.testing import CliRunner

from identification.mismatch.diagnosis import Ambiguous, Diagnosis, Finding, HeldOutRmse, RivalFinding, Rmse
from rig.blind.beside import (
    AtStrength,
    Found,
    HeldOut,
    Method,
    Named,
    Peers,
    RealCase,
    RealRecordings,
    read,
    real_case,
    unanswered,
    write,
)
from rig.blind.collecting import Collected, Known
from rig.blind.command import prove_command
from rig.blind.report.page import proof_page
from rig.blind.scoring.tables import tables
from rig.blind.store import ProofError
from rig.report.page import html
from tests.rig.blind_scores import whole_proof

ROOT = Path(__file__).parents[3]
METHODS = (
    Method(
        "rig diagnose",
        {},
        (
            AtStrength(15.0, Named(25, 10, 0, 1), 1.003, 1.15, 4.8),
            AtStrength(40.0, Named(28, 6, 0, 2), 1.01, None, 4.1),
        ),
        0,
        36,
    ),
    Method("SysIdentPy FROLS", {"criterion": "apress"}, (AtStrength(15.0, Named(22, 0, 14, 0), 1.0, 1.2, 0.5),), 36, 0),
    Method("C V|V| alone", {}, (AtStrength(15.0, None, 1.018, 1.4, 0.0),), 0, 36),
)
PEERS = Peers("abc", "w0", 1000, 36, {"sysidentpy": "0.9.1"}, METHODS)
TANK = RealCase(
    "tank <static>",
    "ambiguous",
    "These cannot tell a from b.",
    (Found("dead_band", "shrink", "A dead band.", ("exponent",)), Found("asymmetry", "", "C+ is not C-.", ())),
    "thrust",
    "N",
    HeldOut(4.31234, 1.2, None, "other runs"),
)
REAL = RealRecordings("abc", (TANK, RealCase("pool", "refused", "pool.csv has no thrust")))


def loaded(path: Path):
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[path.stem] = module  # a dataclass looks there for its annotations
    try:
        spec.loader.exec_module(module)
    finally:
        del sys.modules[path.stem]
    return module


def diagnosis() -> Diagnosis:
    rival = RivalFinding("exponent", "", {}, 1.0, "Or so.")
    finding = Finding("dead_band", "shrink", "A dead band.", {}, 0.0, 50.0, 0.9, (rival,))
    held = HeldOutRmse(2.0, 1.0, float("nan"), "blocks of time")
    nothing = {"mismatch": (), "model_terms": (), "model": {}}
    return Diagnosis(
        recordings=("r",),
        thruster="T1",
        answer=Ambiguous((finding,), None),
        baseline_model="C V|V|",
        baseline={},
        train=Rmse(2.0, 1.0),
        heldout=held,
        chi2_per_dof=1.0,
        whiteness_p=0.5,
        **nothing,
    )


@pytest.mark.parametrize("figures", [PEERS, REAL, RealRecordings("abc", ())])
def test_files_come_back_as_they_were(tmp_path, figures):
    write(tmp_path / "new" / "a.json", figures)
    assert read(tmp_path / "new" / "a.json") == figures


def test_what_is_kept_of_an_answer():
    kept = real_case("tank", diagnosis())
    assert kept.findings == (Found("dead_band", "shrink", "A dead band.", ("exponent",)),)
    assert kept.held_out == HeldOut(2.0, 1.0, None, "blocks of time")
    assert (kept.verdict, kept.response, kept.unit) == ("ambiguous", "thrust", "N")
    assert kept.statement == diagnosis().statement


def test_the_peers_are_counted(tmp_path):
    counting = loaded(ROOT / "benchmarks" / "peers" / "counting.py")

    def answer(method, kind, effect, *named, rivals=(), error=1.0):
        return counting.Answer(method, kind, effect, 0, named, rivals, error, 2.0, {"penalty": 16.0})

    answers = [
        answer("ours", "clear", "heating", "heating", error=1.3),
        answer("ours", "clear", "heating", "supply_sag", rivals=("heating",), error=1.0),
        answer("ours", "clear", "heating", "supply_sag", error=1.1),
        answer("ours", "clear", "heating"),
        answer("ours", "clean", "", "zero_offset"),
        answer("ours", "clean", ""),
        answer("bare", "clear", "heating", error=float("inf")),
    ]
    kinds = {"clean": 0.0, "clear": 15.0, "plain": 40.0}
    ours, bare = found = counting.counted(answers, ("ours", "silent", "bare"), kinds, "bare")
    assert (ours.name, ours.alarms, ours.quiet, ours.setting) == ("ours", 1, 1, {"penalty": 16.0})
    assert [(at.strength, at.named, at.seconds) for at in ours.at] == [(15.0, Named(1, 1, 1, 1), 2.0)]
    assert ours.at[0].error_median == pytest.approx(1.05)
    assert (bare.at[0].named, bare.at[0].error_median) == (None, None)
    rows = counting.table(found).splitlines()
    assert rows[2] == "| ours | 15 | 25 % | 25 % | 25 % | 25 % | 1.050 | 1.27 | 1 of 2 | 2.0 |"
    assert {row.count("|") for row in rows[:3]} == {11}
    write(tmp_path / "a.json", replace(PEERS, methods=found))
    assert read(tmp_path / "a.json").methods == found


def test_a_crash_is_told_as_one():
    assert unanswered("a", ProofError("no thrust")) == RealCase("a", "refused", "no thrust")
    assert unanswered("a", ZeroDivisionError("x")) == RealCase("a", "crashed", "ZeroDivisionError: x")


@pytest.mark.parametrize("name", ["real_diagnosis", "real_vehicle_diagnosis"])
def test_an_example_writes_what_is_read(tmp_path, name):
    """With folders that hold none of the recordings: a case that can't be imported is told, not left out."""
    program = loaded(ROOT / "examples" / f"{name}.py")
    out = tmp_path / "out.json"
    words = [str(tmp_path), "--json", str(out), *(["--only", "sag"] if name == "real_diagnosis" else [])]
    done = CliRunner().invoke(program.main, words)
    assert done.exit_code == 0, done.output
    found = read(out)
    assert {case.verdict for case in found.cases} == {"refused"}
    assert all(case.statement in done.output for case in found.cases)


def changed(figures, **values) -> str:
    return json.dumps({**asdict(figures), **values})


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("no JSON", "is not JSON"),
        (b"\xff\xfe", "is not JSON"),
        ("[]", "got 'list'"),
        ('{"format": "thruster-rig-proof"}', "got 'thruster-rig-proof'"),
        ('{"format": ["thruster-rig-peers"]}', "expected the format"),
        (changed(PEERS, version=2), "version: Input should be 1, got 2"),
        (changed(PEERS, each=-1), "each: Input should be greater than or equal to 0, got -1"),
        (changed(PEERS, methods="many"), "methods: Input should be a valid"),
        ('{"format": "thruster-rig-peers"}', "diagnosis: Field required"),
        (changed(REAL, cases=[{**asdict(TANK), "verdict": "fine"}]), "cases.0.verdict: Input should be 'adequate'"),
        (json.dumps(asdict(REAL)).replace("4.31234", "NaN"), "cases.0.held_out.before"),
    ],
)
def test_a_file_that_is_no_such_file_is_refused(tmp_path, content, said):
    path = tmp_path / "a.json"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(ProofError) as error:
        read(path)
    assert str(path) in str(error.value)
    assert said in str(error.value)
    assert "benchmarks/peers.py --json" in str(error.value)


def invoked(tmp_path, *words):
    return CliRunner().invoke(prove_command, ["--no-run", "--store", str(tmp_path / "store"), *map(str, words)])


def test_the_command_refuses_before_anything_is_computed(tmp_path):
    out = tmp_path / "figures.json"
    missing = invoked(tmp_path, "--json", out, "--beside", tmp_path / "none.json")
    assert (missing.exit_code, out.exists()) == (2, False)
    assert "none.json can't be read (No such file or directory)" in missing.output
    write(tmp_path / "a.json", PEERS)
    nowhere = invoked(tmp_path, "--beside", tmp_path / "a.json")
    assert nowhere.exit_code == 2
    assert "give --report or --json too" in nowhere.output


def test_json_and_page_hold_them(tmp_path):
    for name, figures in (("p.json", PEERS), ("r.json", REAL)):
        write(tmp_path / name, figures)
    out, page = tmp_path / "figures.json", tmp_path / "page.html"
    words = ("--seeds", "1", "--json", out, "--report", page)
    done = invoked(tmp_path, *words, "--beside", tmp_path / "p.json", "--beside", tmp_path / "r.json")
    assert done.exit_code == 0, done.output
    figures = json.loads(out.read_text(encoding="utf-8"))
    assert figures["peers"] == json.loads(json.dumps([asdict(PEERS)]))
    assert figures["real_recordings"] == json.loads(json.dumps([asdict(REAL)]))
    text = page.read_text(encoding="utf-8")
    for part in ("Peers on the same recordings", "25 of 36", "sysidentpy 0.9.1", "36 of 36", "criterion apress"):
        assert part in text
    for part in ("Real recordings", "tank &lt;static&gt;", "dead_band (or exponent) + asymmetry", "4.312 N", "refused"):
        assert part in text


def test_without_them_the_page_has_no_such_section(tmp_path):
    out, page = tmp_path / "figures.json", tmp_path / "page.html"
    assert invoked(tmp_path, "--seeds", "1", "--json", out, "--report", page).exit_code == 0
    figures = json.loads(out.read_text(encoding="utf-8"))
    assert (figures["peers"], figures["real_recordings"]) == ([], [])
    text = page.read_text(encoding="utf-8")
    assert "Real recordings" not in text
    assert "Peers" not in text


def test_another_version_of_the_diagnosis_is_told():
    scores = [score for score in whole_proof(1) if score.order.cell == "clean"]
    figures = tables(scores, 1, ("abc",), ())

    def page(version):
        found = Collected(tuple(Known(score, version, "") for score in scores), 0, ())
        return html(proof_page(found, figures, [PEERS, REAL]))

    assert "not that of this proof" not in page("abc")
    assert page("def").count("By version abc of the diagnosis, which is not that of this proof.") == 2
