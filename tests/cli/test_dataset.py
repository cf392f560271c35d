import json

import pytest

import pica


@pytest.fixture
def asked(monkeypatch):
    calls = []

    def dataset(scene, output, **arguments):
        arguments["progress"](3, 3)
        calls.append({"scene": scene(), "output": output, **arguments})

    monkeypatch.setattr(pica, "dataset", dataset)
    return calls


def test_arguments_reach_the_function(run, asked, tmp_path):
    more = ["--cameras", "sphere", "--count", "7", "--labels", "depth, motion", "--size", "8x4", "--seed", "5"]
    more += ["--workers", "3", "--frames", "2", "--preset", "raster", "--device", "x", "--resume", "--cluster", "auto"]
    code, out, err = run("dataset", "cornell", "-o", tmp_path / "out", *more)
    assert code == 0 and "7 pictures" in out, err
    (call,) = asked
    assert call["scene"].name == "cornell" and call["output"] == tmp_path / "out"
    assert (call["cameras"], call["camera"], call["count"], call["size"]) == ("sphere", None, 7, (8, 4))
    assert (call["labels"], call["seed"], call["workers"], call["frames"]) == (["depth", "motion"], 5, 3, 2)
    assert call["settings"].visibility.primary == "raster" and (call["device"], call["resume"], call["cluster"]) == (
        "x",
        True,
        "auto",
    )


def test_a_camera_and_json(run, asked, tmp_path):
    more = ["--eye", "0,1,3", "--target", "0,0,0", "--f-number", "2.8", "--json"]
    code, out, _ = run("dataset", "cornell", "-o", tmp_path, *more)
    assert code == 0 and json.loads(out)["pictures"] == 1000
    assert tuple(asked[0]["camera"].transform[:3, 3]) == (0, 1, 3) and asked[0]["camera"].f_number == 2.8


@pytest.mark.parametrize("more", [["--start", "1"], ["--animation", "0"], ["--count", "0"], ["--size", "8"]])
def test_faults_are_one_line(run, asked, tmp_path, more):
    code, out, err = run("dataset", "cornell", "-o", tmp_path, *more)
    assert (code, out, len(err.splitlines())) == (2, "", 1) and more[0] in err and not asked
