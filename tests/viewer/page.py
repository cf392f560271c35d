"""A page of the viewer without a browser: speaks viser's protocol over a websocket."""

import io
import time
from typing import Any
from uuid import uuid4

import msgspec
import numpy as np
import viser
import zstandard
from PIL import Image
from viser import _messages as messages
from websockets.sync.client import connect

import pica

SECONDS = 30.0
"""That a page waits for anything: the first picture may compile shaders."""


class Page:
    """A client of a WebViewer's address."""

    def __init__(self, address: str, cookie: str = "") -> None:
        ws = address.replace("http://", "ws://")
        protocols, headers = [f"viser-v{viser.__version__}"], {"Cookie": cookie}
        self.socket = connect(ws, subprotocols=protocols, max_size=None, compression=None, additional_headers=headers)
        self.inputs: dict[str, str] = {}
        """Ids of the panel's inputs, by label."""
        self.texts: dict[str, Any] = {}
        """Newest contents and values of the panel, by id."""

    def close(self) -> None:
        self.socket.close()

    def send(self, message: messages.Message) -> None:
        self.socket.send(msgspec.msgpack.encode(message.as_serializable_dict()))

    def look(self, camera: pica.Camera, size: tuple[int, int], target=(0.0, 0.0, 0.0)) -> None:
        """Move the camera, on a canvas of (width, height)."""
        pose = camera.pose("opencv")
        self.send(
            messages.ViewerCameraMessage(
                wxyz=quaternion(pose[:3, :3]),
                position=tuple(pose[:3, 3].tolist()),
                fov=camera.vertical_fov,
                near=0.01,
                far=1000.0,
                image_height=size[1],
                image_width=size[0],
                look_at=tuple(map(float, target)),
                up_direction=(0.0, 1.0, 0.0),
            )
        )

    def click(self, x: float, y: float) -> None:
        ray = {"ray_origin": (0.0, 0.0, 0.0), "ray_direction": (0.0, 0.0, 1.0)}
        self.send(messages.ScenePointerMessage(event_type="click", screen_pos=((x, y),), modifier=None, **ray))

    def set(self, label: str, value: Any) -> None:
        """Change an input of the panel."""
        self.send(messages.GuiUpdateMessage(self.inputs[label], {"value": value}))

    def upload(self, label: str, name: str, content: bytes) -> None:
        """Send a file to an upload button."""
        ids = {"source_component_uuid": self.inputs[label], "transfer_uuid": uuid4().hex}
        parts = {"part_count": 1, "size_bytes": len(content)}
        self.send(messages.FileTransferStartUpload(filename=name, mime_type="", **parts, **ids))
        self.send(messages.FileTransferPart(part_index=0, content=content, **ids))

    def read(self, seconds: float) -> list[dict[str, Any]]:
        """The messages that arrive next, within so many seconds."""
        data = self.socket.recv(timeout=seconds)
        packed = int.from_bytes(data[8:16], "little")
        window = msgspec.msgpack.decode(zstandard.ZstdDecompressor().decompress(data[16 : 16 + packed]))
        for message in window["messages"]:
            props, uuid = message.get("props") or {}, message.get("uuid")
            if uuid is not None and "label" in props:
                self.inputs[props["label"]] = uuid
            if message["type"] == "GuiUpdateMessage":
                self.texts[uuid] = message["updates"]
        return window["messages"]

    def wait(self, wanted, seconds: float = SECONDS) -> Any:
        """The first true `wanted(message)` of the messages that arrive."""
        until = time.monotonic() + seconds
        while (left := until - time.monotonic()) > 0:
            for message in self.read(left):
                if found := wanted(message):
                    return found
        raise TimeoutError("nothing like that has come")

    def picture_and(self, other, wanted, seconds: float = SECONDS) -> None:
        """Wait for a picture and another message, in either order: viser sends them from two buffers."""
        left = [other, lambda message: _accepted(message, wanted)]

        def come(message: dict[str, Any]) -> bool:
            left[:] = [each for each in left if not each(message)]
            return not left

        self.wait(come, seconds)

    def picture(self, wanted=lambda pixels: True, seconds: float = SECONDS) -> np.ndarray:
        """(height, width, 3) the next picture for which `wanted` is true."""
        [pixels] = self.wait(lambda message: _accepted(message, wanted), seconds)
        return pixels

    def input(self, label: str, seconds: float = SECONDS) -> None:
        """Wait for an input that comes when something is selected."""
        self.wait(lambda message: (message.get("props") or {}).get("label") == label, seconds)

    def text(self, part: str, seconds: float = SECONDS) -> str:
        """The next text of the panel, or note, that contains `part`."""
        return self.wait(lambda message: next((text for text in _texts(message) if part in text), ""), seconds)


def _accepted(message: dict[str, Any], wanted) -> list[np.ndarray]:
    if message["type"] != "BackgroundImageMessage" or message["rgb_data"] is None:
        return []
    pixels = np.asarray(Image.open(io.BytesIO(message["rgb_data"])).convert("RGB"))
    return [pixels] if wanted(pixels) else []


def _texts(message: dict[str, Any]) -> list[str]:
    updates = message.get("updates") or message.get("props") or {}
    texts = [updates.get("_markdown"), updates.get("body")]
    return [text for text in texts if isinstance(text, str)]


def quaternion(rotation: np.ndarray) -> tuple[float, ...]:
    """(w, x, y, z) of a (3, 3) rotation: the eigenvector of Bar-Itzhack 2000, "New Method for Extracting the Quaternion
    from a Rotation Matrix"."""
    (a, b, c), (d, e, f), (g, h, i) = rotation
    rows = [[a - e - i, b + d, c + g, h - f], [b + d, e - a - i, f + h, c - g], [c + g, f + h, i - a - e, d - b]]
    matrix = np.array([*rows, [h - f, c - g, d - b, a + e + i]])
    x, y, z, w = np.linalg.eigh(matrix)[1][:, -1].tolist()
    return w, x, y, z
