"""`rig calibrate`: a table of weights and readings in, lines for the bench file out."""

import pytest

from rig.cli import main

MASSES = (0, 1, 2, 4, 6, 8, 10, 8, 6, 4, 2, 1, 0)
NOISE = (0.3, -0.4, 0.1, 0.2, -0.3, 0.4, -0.2, 0.0, 0.3, -0.1, -0.3, 0.2, 0.1)


def table(folder, wrong_step=None, head="mass_kg,reading"):
    """A cell of 1000 counts per kg."""
    rows = [
        f"{mass + (1 if i == wrong_step else 0)},{1000 * mass + 250 + noise}"
        for i, (mass, noise) in enumerate(zip(MASSES, NOISE, strict=True))
    ]
    path = folder / "steps.csv"
    path.write_text("# put on and taken off\n" + "\n".join([head, *rows]) + "\n")
    return path


def test_lines_for_the_bench_file(tmp_path, capsys):
    assert main(["calibrate", str(table(tmp_path)), "--weights-std", "1e-4"]) == 0
    said = capsys.readouterr().out
    assert "13 steps" in said
    scale = float(said.split("scale = ")[1].split(",")[0])
    assert scale == pytest.approx(9.80665e-3, rel=1e-3)
    assert float(said.split("offset = ")[1].split(",")[0]) == pytest.approx(-250 * 9.80665e-3, abs=0.01)
    assert float(said.split("gain_std = ")[1]) == pytest.approx(1e-4, rel=0.2)
    assert "WRONG" not in said


def test_a_wrong_weight_ends_with_status_1(tmp_path, capsys):
    assert main(["calibrate", str(table(tmp_path, wrong_step=4))]) == 1
    said = capsys.readouterr().out
    assert "WRONG          step 5: 68.647 N (7 kg) was entered, the reading says 58.8" in said
    assert "calibrate again" in said


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("mass_kg,counts\n1,2\n", "expected the columns mass_kg or force_N, and reading; came"),
        ("mass_kg,force_N,reading\n1,2,3\n", "not both"),
        ("mass_kg,reading\n1,2\nx,3\n", "step 2: mass_kg is 'x', a finite number is expected"),
        ("mass_kg,reading\n1,2\n2\n", "step 2: reading is None"),
        ("mass_kg,reading\n1,2\n2,4\n", "too few"),
        ("", "expected the columns"),
    ],
)
def test_a_table_that_can_not_be_used(tmp_path, capsys, text, said):
    path = tmp_path / "steps.csv"
    path.write_text(text)
    assert main(["calibrate", str(path)]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1


def test_a_table_that_is_not_there(tmp_path, capsys):
    assert main(["calibrate", str(tmp_path / "none.csv")]) == 2
    assert "can't be read" in capsys.readouterr().err
