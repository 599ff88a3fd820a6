"""The fuzzer: it finds faults that are planted, and none in the product."""

import subprocess
import sys
from pathlib import Path

import planted
import pytest

SCRIPTS = Path(__file__).parents[1] / "scripts"
INPUTS = {"recipes": 5, "media": 12}


@pytest.fixture
def fuzz(monkeypatch):
    monkeypatch.syspath_prepend(str(SCRIPTS))
    import fuzz

    return fuzz


def test_planted_faults_are_found(fuzz, tmp_path, capsys):
    tried, failures = fuzz.fuzz({"planted": "planted"}, "s", tmp_path, range(len(planted.FAULTS)), 2)
    assert tried == {"planted": len(planted.FAULTS)}
    found = {(folder / "input" / "does").read_text(): faults[0] for folder, faults in failures.items()}
    assert found.pop("computes").split(" (")[0] in ("it computes for too long", "it waits")  # where others compute, too
    assert {does: found[does].split(" (")[0] for does in found} == {
        "waits": "it waits",
        "dies": "Fatal Python error: Segmentation fault",
        "killed": "exit code -9: ",
        "raises": "ValueError: invalid literal for int() with base 10: 'five'",
        "leaves": "exit code 3: ",
        "takes memory": "MemoryError",
        "prints a trace": "OSError: no",
        "changes the source": "changed: in/film",
        "removes through a link": "changed: outside/keep",
        "leaves a part": "left behind: out/.part-1",
    }
    assert found["raises"].endswith("(tests/planted.py:16)")
    said = capsys.readouterr().out
    for folder in failures:
        assert f"scripts/fuzz --repeat {folder}" in said
        assert not (folder / "work").exists()
    assert sorted(tmp_path.iterdir()) == sorted(failures)


def test_an_input_depends_on_its_name_alone(fuzz, tmp_path):
    numbers = (5, 3), (3,)
    for run, chosen in enumerate(numbers):
        fuzz.fuzz({"planted": "planted"}, "s", tmp_path / str(run), chosen, 9)
    films = [(tmp_path / run / "planted-s-3" / "input" / "in" / "film").read_text() for run in "01"]
    assert films[0] == films[1] != (tmp_path / "0" / "planted-s-5" / "input" / "in" / "film").read_text()


def test_a_failure_is_repeated_from_its_input(fuzz, tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(fuzz.KINDS, "planted", "planted")
    raises = list(planted.FAULTS).index("raises")
    fuzz.fuzz({"planted": "planted"}, "s", tmp_path, [raises], 9)
    folder = tmp_path / f"planted-s-{raises}"
    assert fuzz.main(["--repeat", str(folder)]) == 1
    assert "ValueError: invalid literal" in capsys.readouterr().out
    (folder / "input" / "does").write_text("nothing")
    assert fuzz.main(["--repeat", str(folder)]) == 0


@pytest.mark.parametrize("kind", INPUTS)
def test_nothing_is_found(tmp_path, kind):
    options = ["--kinds", kind, "--seed", "ci", "--inputs", str(INPUTS[kind]), "--output", str(tmp_path)]
    command = [sys.executable, str(SCRIPTS / "fuzz.py"), *options]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert f"{kind}: {INPUTS[kind]} inputs, 0 failed" in done.stdout
