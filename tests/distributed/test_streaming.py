import subprocess
import sys

import numpy as np
import pytest

import pica
from pica.distributed.samples import LABELS, Sampler, views_for
from pica.distributed.viewpoints import viewpoints
from pica.errors import PicaError
from pica.scenes.basic_meshes import sphere
from pica.scenes.placing import move
from tests.building import lambert, placed, still_life

SIZE = 32, 24


def samples(**more):
    return pica.torch_dataset(still_life(), size=SIZE, frames=1, **more)


@pytest.fixture
def torch(device):
    return pytest.importorskip("torch", reason="PyTorch is not installed")


def test_samples_are_those_of_the_sampler(torch, device):
    rendered = samples(count=3, seed=4, device=device.name)
    got = list(rendered)
    assert [sample["number"] for sample in got] == [0, 1, 2]
    scene, settings = still_life(), pica.Settings().with_values({"seed": 4})
    sampler = Sampler(scene, SIZE, settings, 1, device.name)
    [expected] = sampler([viewpoints("sphere", scene, SIZE, 3, seed=4).at(2)], LABELS)
    last = got[2]
    assert np.array_equal(last["picture"], expected.picture.display)
    for name in LABELS:
        assert np.array_equal(last[name], expected.label(name)), name
    assert last["instance"].dtype == last["semantic"].dtype == torch.int64
    camera = expected.viewpoint.now.camera
    assert np.array_equal(last["pose"], camera.pose("opencv"))
    assert np.array_equal(last["intrinsics"], camera.intrinsics(SIZE))
    assert torch.equal(next(iter(rendered))["depth"], got[0]["depth"])  # again from the start


@pytest.mark.parametrize("animated", [False, True], ids=["rigid", "animated"])
@pytest.mark.parametrize("labels", [("depth", "motion"), ("depth",)], ids=["motion", "rest"])
def test_samples_depend_on_their_numbers_alone(device, labels, animated):
    """Not on the samples that are rendered at the same time, whose surfaces and lights differ in brightness; light
    below translucent surfaces, which other views share, is traced by each."""
    wax = lambert(0.8, diffuse_transmission=1.0, thin_walled=False, scattering=(10.0, 10.0, 10.0))
    scene, settings = still_life(), pica.Settings()
    scene.add(placed(sphere(0.3, wax), move(0, 0.3, 0.9), "wax"))
    if animated:
        scene.roots[1].pose = pica.Pose(np.array([-0.9, 0.5, 0]))
        rises = pica.Channel(scene.roots[1], "translation", np.array([0.0, 2]), np.array([[-0.9, 0.5, 0], [0, 1.5, 0]]))
        scene.animations = [pica.Animation([rises])]
    places = viewpoints("sphere", scene, SIZE, 5, seed=1)
    alone, together = (Sampler(scene, SIZE, settings, 2, device, views=views) for views in (1, 3))
    expected = list(alone.each(range(5), places, labels))
    found = list(together.each(range(5), places, labels))
    assert [number for number, _ in found] == list(range(5))
    for (_, sample), (_, other) in zip(found, expected, strict=True):
        assert np.array_equal(sample.picture.color, other.picture.color)
        assert all(np.array_equal(sample.label(name), other.label(name)) for name in labels)


def test_processors_render_one_by_one_and_cards_no_more_than_fit(device):
    assert Sampler(still_life(), SIZE, pica.Settings(), 1, device).views == 1 or not device.is_software
    assert [views_for(size) for size in ((128, 128), (640, 360), (1920, 1080))] == [10, 5, 1]


def test_it_goes_on_for_ever_without_a_count(torch, device):
    endless = iter(samples(labels=("depth",), device=device.name))
    assert [next(endless)["number"] for _ in range(3)] == [0, 1, 2]


@pytest.mark.slow
def test_two_workers_give_no_picture_twice(torch, device):
    rendered = samples(count=5, labels=("depth",), device=device.name)
    alone = {sample["number"]: sample["depth"] for sample in rendered}
    loader = torch.utils.data.DataLoader(rendered, batch_size=2, num_workers=2, multiprocessing_context="spawn")
    numbers = []
    for batch in loader:
        assert batch["picture"].shape[1:] == (*SIZE[::-1], 3)
        for number, depth in zip(batch["number"].tolist(), batch["depth"], strict=True):
            numbers.append(number)
            assert torch.equal(depth, alone[number])
    assert sorted(numbers) == [0, 1, 2, 3, 4]


def test_impossible_arguments(torch):
    with pytest.raises(PicaError, match=r"no label 'dept'"):
        samples(labels=("dept",))
    with pytest.raises(PicaError, match=r"count.*0"):
        samples(count=0)


def test_without_pytorch_one_line_says_so():
    program = """
import sys
sys.modules["torch"] = None
import pica
try:
    pica.torch_dataset(pica.scenes.cornell())
except pica.PicaError as error:
    print(error)
"""
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=True)
    assert run.stdout == "torch_dataset: PyTorch is not installed; pip install torch\n"
