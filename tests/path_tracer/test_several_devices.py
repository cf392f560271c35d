"""Pictures whose samples several devices share."""

import numpy as np
import pytest
import slangpy as spy

import pica
from pica.errors import DeviceError, PicaError
from pica.path_tracer.shared_samples import SharedSamples
from pica.rhi.adapters import adapter_of, adapters
from pica.scenes.placing import move
from tests.building import still_life

CAMERA = pica.Camera.look_at((0, 1.2, 3.4), (0, 0.4, 0))
SIZE = (24, 16)


@pytest.fixture(scope="module")
def second(device):
    """Another logical device on the same adapter."""
    own = spy.Device(type=spy.DeviceType.vulkan, adapter_luid=adapter_of(device.handle).luid)
    yield own
    own.close()


@pytest.fixture(scope="module")
def pair(device, second):
    with pica.PathTracer(still_life(), size=SIZE, devices=[device, second]) as tracer:
        yield tracer


@pytest.mark.device
@pytest.mark.parametrize("samples", [1, 2, 3, 24])
def test_the_picture_is_that_of_one_device(device, pair, samples):
    """Every sample is made once; sums of floats are rounded in another order."""
    told = []
    frame = pair.render(samples, camera=CAMERA, progress=lambda done, total: told.append((done, total)))
    alone = pica.PathTracer(still_life(), size=SIZE, device=device).render(samples, camera=CAMERA)
    np.testing.assert_allclose(frame.color, alone.color, rtol=2e-5, atol=1e-6)
    for name in ("normal", "depth", "instance"):
        np.testing.assert_array_equal(frame.aov(name), alone.aov(name))
    assert told[0] == (1, samples) or told[0][0] > 1
    assert told[-1] == (samples, samples) and told == sorted(told)


@pytest.mark.device
def test_both_make_samples(pair, monkeypatch):
    other, sums = pair._others[0], []
    whole = pica.PathTracer.sum_of
    monkeypatch.setattr(other, "sum_of", lambda *given, **named: sums.append(whole(other, *given, **named)) or sums[-1])
    pair.render(24, camera=CAMERA)
    assert sums[0].any()


@pytest.mark.device
def test_all_devices_see_what_is_edited(device, pair):
    scene = pair.scene
    node = next(node for node in scene.nodes() if node.mesh is not None)
    before, transform = pair.render(16, camera=CAMERA).color, node.transform
    node.transform = move(0, 0.4, 0) @ transform
    edited = pair.render(16, camera=CAMERA).color
    alone = pica.PathTracer(scene, size=SIZE, device=device).render(16, camera=CAMERA).color
    node.transform = transform
    assert np.abs(edited - before).max() > 0.05
    np.testing.assert_allclose(edited, alone, rtol=2e-5, atol=1e-6)


@pytest.mark.device
def test_a_device_that_fails_is_named_and_the_next_picture_is_whole(pair, monkeypatch):
    expected = pair.render(8, camera=CAMERA).color
    with monkeypatch.context() as patch:
        patch.setattr(pair._others[0].view, "sync", lambda: 1 / 0)
        with pytest.raises(DeviceError, match=r"device .*llvmpipe.* failed while it shared a picture: division"):
            pair.render(64, camera=CAMERA)
    np.testing.assert_allclose(pair.render(8, camera=CAMERA).color, expected, rtol=2e-5, atol=1e-6)


@pytest.mark.device
def test_a_callback_that_raises_stops_all_of_them(pair):
    def stop(done: int, total: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        pair.render(10**9, camera=CAMERA, progress=stop)


@pytest.mark.device
def test_a_callback_that_closes_it_stops_all_of_them(device, second):
    tracer = pica.PathTracer(still_life(), size=SIZE, devices=[device, second])
    with pytest.raises(PicaError, match="it is closed"):
        tracer.render(10**9, camera=CAMERA, progress=lambda done, total: tracer.close())


@pytest.mark.device
def test_closing_closes_all(device, second):
    tracer = pica.PathTracer(still_life(), size=SIZE, devices=[device, second])
    others = tracer._others
    assert tracer.device_name == f"{device.name} and {device.name}"
    tracer.close()
    tracer.close()
    assert tracer.closed and all(other.closed for other in others)


def test_a_faster_device_makes_more_samples():
    """A hundred to one, as the clock of each says."""
    shared, clocks, made = SharedSamples(1000), {"fast": 0, "slow": 0}, {"fast": [0], "slow": []}
    while True:
        name = min(clocks, key=lambda each: clocks[each])
        index = shared.take()
        if index is None:
            break
        made[name].append(index)
        clocks[name] += 1 if name == "fast" else 10
    assert sorted(made["fast"] + made["slow"]) == list(range(999))
    assert len(made["fast"]) == pytest.approx(10 * len(made["slow"]), rel=0.05)


@pytest.mark.device
@pytest.mark.parametrize(
    ("devices", "message"),
    [
        ([], "must be a list of one device or more"),
        ("0,1", "must be a list of one device or more"),
        ([0, 0], "one of them is named twice"),
        ([0, 99], "no device #99; there are"),
        ([True], "neither a name nor a number"),
        ([0.5], "neither a name nor a number"),
    ],
)
def test_impossible_devices_are_named(devices, message):
    with pytest.raises(DeviceError, match=message):
        pica.PathTracer(still_life(), size=SIZE, devices=devices)


@pytest.mark.device
def test_one_way_to_name_them(device):
    with pytest.raises(PicaError, match="device and devices are two ways"):
        pica.PathTracer(still_life(), size=SIZE, device=device, devices=[device])


@pytest.mark.device
def test_a_device_has_a_uuid(device):
    identity = bytes(adapters()[0].luid).hex()
    assert pica.PathTracer(still_life(), size=SIZE, device=f"GPU-{identity[:8]}-{identity[8:]}").device is device
    with pytest.raises(DeviceError, match="no device has the UUID 0000"):
        pica.PathTracer(still_life(), size=SIZE, device="0" * 32)
