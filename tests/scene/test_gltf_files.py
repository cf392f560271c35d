"""Which files an asset may name: those in its folder and below, and no pipes or devices."""

import io
import os
import socket
from collections.abc import Callable
from pathlib import Path

import pytest
from PIL import Image

from pica import files
from pica.errors import SceneError
from pica.scene.gltf import asset_files
from pica.scene.loading import load
from tests.scene.gltf_files import TRIANGLE, GltfFile

pytestmark = pytest.mark.filterwarnings("ignore:.*has no light")
KINDS = ("model.gltf buffer", "model.gltf picture", "model.glb buffer", "model.glb picture")
every_kind = pytest.mark.parametrize("kind", KINDS)


def picture() -> bytes:
    stream = io.BytesIO()
    Image.new("RGB", (2, 2), (255, 0, 0)).save(stream, "PNG")
    return stream.getvalue()


def asset(folder: Path, uri: str, kind: str = KINDS[0]) -> Path:
    """An asset whose second buffer or whose picture is what a URI names."""
    folder.mkdir(exist_ok=True)
    name, part = kind.split()
    file = GltfFile()
    positions = file.accessor(TRIANGLE)
    if part == "buffer":
        file.more_buffers = [{"uri": uri, "byteLength": 36}]
        view = file.add("bufferViews", buffer=1, byteLength=36)
        positions = file.add("accessors", bufferView=view, componentType=5121, count=9, type="VEC3")
    file.add("images", uri=uri)
    file.add("textures", source=0)
    texture = {"emissiveTexture": {"index": 0}} if part == "picture" else {}
    file.mesh(positions, material=file.add("materials", **texture))
    return file.write(folder, name)


@pytest.fixture
def place(tmp_path: Path) -> Path:
    """A folder with secrets: `models` within it is for assets."""
    content = picture()
    assert len(content) > 36
    for folder in ("models", "models/sub", "secret", "models-too"):
        (tmp_path / folder).mkdir()
    for name in ("x", "secret/x", "models-too/x", "models/inside", "models/sub/inside", "models/with space"):
        (tmp_path / name).write_bytes(content)
    return tmp_path


@every_kind
@pytest.mark.parametrize(
    "uri", ["inside", "./inside", "sub/inside", "sub/../inside", "sub//inside", "%69nside", "with%20space",
            "with space", "../models/inside"],
)  # fmt: skip
def test_files_of_the_folder_are_read(uri: str, kind: str, place: Path) -> None:
    assert load(asset(place / "models", uri, kind)).triangle_count() > 0


@every_kind
@pytest.mark.parametrize(
    "uri", ["../x", "%2e%2e/x", "..%2fx", "%2E%2E%2Fx", "sub/../../x", "./../secret/x", "../models-too/x", "link",
            "links/x"],
)  # fmt: skip
def test_files_outside_are_not_read_unless_asked_for(uri: str, kind: str, place: Path) -> None:
    (place / "models" / "link").symlink_to(place / "secret" / "x")
    (place / "models" / "links").symlink_to(place / "secret")
    path = asset(place / "models", uri, kind)
    part = "images" if "picture" in kind else "buffers"
    with pytest.raises(SceneError, match=rf"{part}\[\d\].uri: '.*' lies outside the asset's folder") as caught:
        load(path)
    assert "pica.load(…, allow_outside=True) or --allow-outside" in str(caught.value)
    assert load(path, allow_outside=True).triangle_count() > 0


def test_whether_a_file_outside_exists_is_not_told(place: Path) -> None:
    with pytest.raises(SceneError, match="lies outside"):
        load(asset(place / "models", "../missing"))


@pytest.mark.parametrize("outside", [False, True])
@every_kind
@pytest.mark.parametrize(
    "uri", ["/etc/passwd", "%2fetc/passwd", "//server/share", "file:///etc/passwd", "file:x", "http://localhost/x",
            "https://localhost/x", "ftp://localhost/x", "C:\\x", "c:/x", "\\\\server\\x", "\\x", "a\0b", "a%00b"],
)  # fmt: skip
def test_absolute_names_and_schemes_are_never_followed(uri: str, kind: str, outside: bool, place: Path) -> None:
    with pytest.raises(SceneError, match=r"is not a path relative to the file") as caught:
        load(asset(place / "models", uri, kind), allow_outside=outside)
    assert str(caught.value).isprintable()


@every_kind
@pytest.mark.parametrize(
    "uri", ["gone", "gone/inside", "inside/x", "..\\x", "sub\\inside", "", "%25zz", "n" * 300, "n/" * 2000, "n" * 5000,
            "a/../" * 100_000 + "inside", "\ud800", "%ff%fe", "loop", "sub", "."],
    ids=lambda uri: ascii(uri)[:12],
)  # fmt: skip
def test_names_of_nothing_end_in_one_line(uri: str, kind: str, place: Path) -> None:
    (place / "models" / "loop").symlink_to("loop")
    with pytest.raises(SceneError, match=r"(buffers\[1\]|images\[0\])(\.uri)?: ") as caught:
        load(asset(place / "models", uri, kind))
    assert str(caught.value).isprintable() and len(str(caught.value)) < 400


def pipe(path: Path) -> None:
    os.mkfifo(path)


def endless(path: Path) -> None:
    path.symlink_to("/dev/zero")


def terminal(path: Path) -> None:
    path.symlink_to("/dev/tty")


def listening(path: Path) -> None:
    here = os.getcwd()
    os.chdir(path.parent)  # the names of sockets are short
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(path.name)
    os.chdir(here)


NO_FILES = (pipe, endless, terminal, listening, Path.mkdir)
no_file = pytest.mark.parametrize("make", NO_FILES, ids=lambda make: make.__name__)


@pytest.mark.timeout(20)
@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="pipes have no names here")
@no_file
@pytest.mark.parametrize("outside", [False, True])
@every_kind
def test_only_regular_files_are_read_and_nothing_waits(
    make: Callable[[Path], object], outside: bool, kind: str, place: Path
) -> None:
    make(place / "models" / "odd")
    with pytest.raises(SceneError, match=r"'odd'(: cannot be read \(it is .*not a file\)| lies outside)"):
        load(asset(place / "models", "odd", kind), allow_outside=outside)


@pytest.mark.timeout(20)
@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="pipes have no names here")
@no_file
def test_the_asset_and_the_environment_are_regular_files(make: Callable[[Path], object], place: Path) -> None:
    odd = place / "odd.hdr"
    make(odd)
    with pytest.raises(SceneError, match=r"odd.hdr: the file: cannot be read \(it is .*not a file"):
        load(odd)
    with pytest.raises(SceneError, match=r"odd.hdr: cannot be read \(it is .*not a file"):
        load(asset(place / "models", "inside"), environment=odd)


def test_the_asset_itself_may_lie_behind_links(place: Path) -> None:
    """As in a cache of a model hub: links bear the names, and all contents lie in one folder."""
    blobs, snapshot = place / "hub" / "blobs", place / "hub" / "snapshots" / "1a2b"
    blobs.mkdir(parents=True)
    (snapshot / "textures").mkdir(parents=True)
    asset(place / "made", "textures/red.png", "model.gltf picture").rename(blobs / "77aa")
    (blobs / "88bb").write_bytes(picture())
    (snapshot / "model.gltf").symlink_to("../../blobs/77aa")
    (snapshot / "textures" / "red.png").symlink_to("../../../blobs/88bb")
    assert load(snapshot / "model.gltf").triangle_count() == 1
    (snapshot / "textures" / "red.png").unlink()
    (snapshot / "textures" / "red.png").symlink_to(place / "secret" / "x")
    with pytest.raises(SceneError, match="lies outside"):
        load(snapshot / "model.gltf")


def test_the_folder_may_be_reached_by_a_link(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (place / "short").symlink_to("models")
    asset(place / "models", "sub/inside")
    assert load(place / "short" / "model.gltf").triangle_count() > 0
    monkeypatch.chdir(place / "models")
    assert load("model.gltf").triangle_count() > 0
    assert load("../short/sub/../model.gltf").triangle_count() > 0


@pytest.mark.parametrize("swapped", ["sub", "sub/inside"])
def test_what_is_swapped_after_it_was_checked_is_not_read(
    swapped: str, place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Somebody who can write into the folder puts a link to elsewhere between the check and the opening."""
    path = asset(place / "models", "sub/inside")
    (place / "secret" / "inside").write_bytes(picture())

    def resolved_then_swapped(path: Path, what: str) -> Path:
        found = files.resolved(path, what)
        if path.name == "inside":
            (place / "models" / swapped).rename(place / "aside")
            (place / "models" / swapped).symlink_to(place / "secret" / swapped.removeprefix("sub").removeprefix("/"))
        return found

    monkeypatch.setattr(asset_files, "resolved", resolved_then_swapped)
    with pytest.raises(SceneError, match=r"buffers\[1\].uri: 'sub/inside': cannot be read"):
        load(path)


def test_no_file_stays_open(place: Path) -> None:
    before = set(os.listdir("/proc/self/fd")) if Path("/proc/self/fd").exists() else set()
    paths = [asset(place / kind.replace(" ", "-"), uri, kind) for kind in KINDS for uri in ("../x", "gone", "..")]
    for path in paths:
        with pytest.raises(SceneError):
            load(path)
    load(asset(place / "models", "inside"))
    assert not before or set(os.listdir("/proc/self/fd")) == before


@pytest.mark.parametrize("wrong", ["yes", 1, None, [True]])
def test_reading_outside_is_allowed_by_true_alone(wrong: object, place: Path) -> None:
    (place / "x").write_bytes(picture())
    with pytest.raises(SceneError, match=r"^load: allow_outside: .* is not True or False$"):
        load(asset(place / "models", "../x"), allow_outside=wrong)  # type: ignore[arg-type]


@pytest.mark.parametrize("wrong", [None, 3, b"model.gltf", 1.5, ["model.gltf"], "a\0b", "gone\n\x1b[31m.gltf"])
def test_what_is_no_path_is_a_scene_error(wrong: object, place: Path) -> None:
    with pytest.raises(SceneError) as caught:
        load(wrong)  # type: ignore[arg-type]
    assert str(caught.value).isprintable()
    if wrong is not None:
        with pytest.raises(SceneError) as caught:
            load(asset(place / "models", "inside"), environment=wrong)  # type: ignore[arg-type]
        assert str(caught.value).isprintable()
