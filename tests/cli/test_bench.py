import json


def test_json_joins_what_the_renderer_measured(run, calls):
    code, out, _ = run("bench", "m.glb", "--size", "8x4", "--frames", "7", "--warm-up", "2", "--json")
    assert code == 0
    assert json.loads(out) == {
        "scene": "m.glb",
        "device": "fake device",
        "size": [8, 4],
        "frames": 7,
        "gpu_ms": {"gbuffer": 0.5},
        "host_ms": 0.25,
        "warm_up": 2,
    }


def test_without_json_a_table(run, calls):
    out = run("bench", "m.glb", "--size", "8x4")[1]
    assert "gbuffer" in out and "0.5" in out
