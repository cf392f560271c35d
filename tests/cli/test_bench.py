import json
import math
from xml.etree import ElementTree

import pytest


def test_json_joins_what_the_renderer_measured(run, calls):
    code, out, _ = run("bench", "m.glb", "--size", "8x4", "--frames", "7", "--warm-up", "2", "--json")
    assert code == 0
    assert json.loads(out) == {
        "scene": "m.glb",
        "device": "fake device",
        "size": [8, 4],
        "frames": 7,
        "peak_gpu_memory": 5,
        "motion": {"sequence": "orbit", "speed": 1.0, "speed_unit": "degrees a frame"},
        "moving": {
            "gpu_ms": {"gbuffer": 0.75, "frame": 0.75},
            "host_ms": 0.25,
            "rays": {"shadow_rays": 8, "surfel_rays": 9},
        },
        "rest": {"gpu_ms": {"gbuffer": 0.5, "frame": 0.5}, "host_ms": 0.25, "rays": {"shadow_rays": 7}},
        "path_traced": {"samples": 3, "sample_ms": 1.5, "frame_over_sample": 0.5},
    }
    assert [(call.frames, call.warm_up) for call in calls] == [(7, 2), (7, 2)]
    moving, rest = calls
    assert rest.play is None and math.dist(moving.play(0).transform[:3, 3], moving.play(90).transform[:3, 3]) > 1


def test_how_many_frames_is_left_to_the_device(run, calls):
    run("bench", "m.glb", "--size", "8x4")
    assert [(call.frames, call.warm_up) for call in calls] == [(None, None)] * 2


def test_json_has_no_numbers_that_json_lacks(run, calls, monkeypatch):
    def unfinished(*_, **__):
        return {"host_ms": float("nan"), "gpu_ms": {"frame": float("inf")}, "each": [1.0, -float("inf")]}

    monkeypatch.setattr("pica.quality.benchmark.benchmark", unfinished)
    result = json.loads(run("bench", "m.glb", "--size", "8x4", "--json")[1], parse_constant=pytest.fail)
    assert result["moving"] == {"host_ms": None, "gpu_ms": {"frame": None}, "each": [1.0, None]}
    assert "nan" in run("bench", "m.glb", "--size", "8x4")[1]


def test_a_table_shows_names_of_all_kinds(run, calls, monkeypatch):
    times = {"gpu_ms": {"sun [bold]\n\x1b[2J": 1.0, "x" * 9999: 2, "frame": 3.0}}
    monkeypatch.setattr("pica.quality.benchmark.benchmark", lambda *_, **__: dict(times))
    out = run("bench", "[red]\n.glb", "--size", "8x4")[1]
    assert out.splitlines()[0] == "[red]\\n.glb" and "  sun [bold]\\n\\x1b[2J" in out
    assert all(line.isprintable() and len(line) < 100 for line in out.splitlines())


def test_without_json_a_table(run, calls):
    out = run("bench", "m.glb", "--size", "8x4")[1]
    lines = [line.split() for line in out.splitlines()]
    assert ["frame_over_sample", "0.5"] in lines and ["sequence", "orbit"] in lines
    assert lines[lines.index(["moving", "at", "rest"]) :] == [
        ["moving", "at", "rest"],
        ["gpu_ms"],
        ["gbuffer", "0.75", "0.5"],
        ["frame", "0.75", "0.5"],
        ["host_ms", "0.25", "0.25"],
        ["rays"],
        ["shadow_rays", "8", "7"],
        ["surfel_rays", "9"],
    ]


def test_a_table_has_no_heading_without_rows(run, calls, monkeypatch):
    times = {"gpu_ms": {"frame": 3.0}, "rays_per_second": {}}
    monkeypatch.setattr("pica.quality.benchmark.benchmark", lambda *_, **__: dict(times))
    assert "rays_per_second" not in run("bench", "m.glb", "--size", "8x4")[1]
    assert json.loads(run("bench", "m.glb", "--size", "8x4", "--json")[1])["rest"]["rays_per_second"] == {}


def test_where_nothing_traces_there_is_no_path_traced_sample(run, calls, monkeypatch):
    monkeypatch.setattr("pica.quality.benchmark.path_traced_sample", lambda *_: None)
    assert json.loads(run("bench", "m.glb", "--size", "8x4", "--json")[1])["path_traced"] is None
    assert "path_traced" not in run("bench", "m.glb", "--size", "8x4")[1]


@pytest.mark.device
def test_progress_on_stderr_and_json_alone_on_stdout(run):
    code, out, err = run("bench", "cornell", "--size", "16x16", "--frames", "2", "--warm-up", "1", "--json")
    result = json.loads(out)
    moving, rest = result["moving"], result["rest"]
    assert code == 0 and result["frames"] == 2 and moving["gpu_ms"]["frame"] > 0 and rest["gpu_ms"]["frame"] > 0
    assert moving["effect_rays"]["global_illumination"] == moving["rays"]["indirect_rays"] > 0
    said = [json.loads(line) for line in err.splitlines() if line.startswith("{")]
    assert {"progress": "Measuring, moving", "done": 3, "total": 3} in said
    assert {"progress": "Measuring, at rest", "done": 3, "total": 3} in said
    sample = result["path_traced"]
    assert sample["samples"] == 3 and {"progress": "Path tracing", "done": 5, "total": 5} in said
    assert sample["frame_over_sample"] == pytest.approx(moving["gpu_ms"]["frame"] / sample["sample_ms"])


def effects_of(way):
    """What a benchmark measured, with effects."""
    return {
        "gpu_ms": {"gbuffer": 1.0, "rays": way, "frame": 1.0 + way},
        "effect_ms": {"gbuffer": 1.0, "global_illumination": way, "off": 0.0},
        "effect_rays": {"global_illumination": 1000},
        "effect_bytes": {"gbuffer": 3_000_000, "shared": 1_000_000, "off": 0},
    }


@pytest.fixture
def effects(monkeypatch):
    def measured(renderer, camera, frames, warm_up, progress, play):
        progress(1, 1)
        return effects_of(0.5 if play is None else 2.0)

    monkeypatch.setattr("pica.quality.benchmark.benchmark", measured)


def test_the_table_has_a_row_for_each_effect_beside_what_is_published(run, calls, effects, tmp_path):
    code, out, _ = run("bench", "m.glb", "--size", "8x4", "--table", "-o", tmp_path / "bars.svg")
    rows = [line.split("  ") for line in out.splitlines()[-5:]]
    rows = [[cell.strip() for cell in row if cell.strip()] for row in rows]
    assert code == 0 and rows[0] == ["effect", "ms moving", "ms at rest", "rays", "MB", "published", "source"]
    assert rows[1] == ["gbuffer", "1.000", "1.000", "0", "3.0"]
    assert rows[2][:5] == ["global_illumination", "2.000", "0.500", "1,000", "0.0"] and rows[2][6] == "RTG 25, 25.2.6"
    assert rows[3] == ["shared", "0.000", "0.000", "0", "1.0"]
    assert rows[4][:5] == ["frame", "3.000", "1.500", "1,000", "4.0"]
    picture = ElementTree.parse(tmp_path / "bars.svg").getroot()
    told = [part.text for part in picture.iter("{http://www.w3.org/2000/svg}title")]
    assert told[1] == "global_illumination: 2 ms" and "global_illumination: 0.5 ms" in told
    table = json.loads(run("bench", "m.glb", "--size", "8x4", "--table", "--json")[1])["table"]
    assert [row["effect"] for row in table] == ["gbuffer", "global_illumination", "shared", "frame"]


def test_a_sweep_measures_each_of_its_steps(run, calls, effects, tmp_path):
    code, out, _ = run("bench", "m.glb", "--size", "30x12", "--sweep", "size", "-o", tmp_path / "sizes.svg")
    lines = [line.split() for line in out.splitlines()]
    assert code == 0 and ["10x4", "20x8", "30x12", "40x16", "60x24"] in lines
    assert ["global_illumination", *["2"] * 5] in lines and ["frame", *["3"] * 5] in lines
    assert "60x24" in (tmp_path / "sizes.svg").read_text()
    result = json.loads(run("bench", "m.glb", "--size", "30x12", "--sweep", "size", "--json")[1])
    assert list(result["steps"]) == ["10x4", "20x8", "30x12", "40x16", "60x24"]


@pytest.mark.parametrize(
    ("asked", "says"),
    [
        (["--sweep", "time"], "pica: sweep 'time' is not one of size, triangles, lights, rays\n"),
        (["-o", "bars.png"], "pica: cannot write bars.png: the name must end in .svg\n"),
    ],
)
def test_wrong_requests_are_one_line_before_anything_is_loaded(run, calls, asked, says):
    assert run("bench", "m.glb", *asked) == (2, "", says) and not calls
