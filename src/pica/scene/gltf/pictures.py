"""The pictures of a file, decoded in threads where it is worth it."""

import os
from collections.abc import Callable, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from hashlib import sha256
from pathlib import PurePosixPath
from typing import Any, NamedTuple
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from pica.errors import shown
from pica.images.blocks import BlockPicture
from pica.images.headers import file_format
from pica.images.ktx2 import UnsupportedPictureError
from pica.images.pictures import open_texture
from pica.scene.gltf.container import Document
from pica.scene.gltf.element import Element
from pica.scene.load_progress import LoadProgress

Picture = NDArray[np.uint8] | BlockPicture
_NO_FILE = PurePosixPath()


class EncodedPicture(NamedTuple):
    """What tells pictures' content apart."""

    digest: bytes
    file_format: str


class Pictures:
    """Content and pictures of a file's images. The same content is decoded once, if that is begun in threads."""

    def __init__(self, document: Document) -> None:
        self._document = document
        self._begun: dict[Element, tuple[EncodedPicture, Callable[[], Picture]]] = {}

    def begin(self, entries: Iterable[Element]) -> None:
        """Read images, and begin to decode them. Raises SceneError for one that cannot be read, or is too large."""
        threads = ThreadPoolExecutor(os.cpu_count(), thread_name_prefix="pica-pictures")
        self._document.closing.callback(threads.shutdown, cancel_futures=True)
        futures: dict[EncodedPicture, Future[Picture]] = {}
        for entry in entries:
            encoded, open_picture = self._read(entry)
            if encoded not in futures:
                try:
                    futures[encoded] = threads.submit(open_picture())
                except UnsupportedPictureError:  # raised again, and handled, when it is used
                    continue
            self._begun[entry] = encoded, futures[encoded].result
        progress = LoadProgress(len(futures))
        for future in futures.values():
            future.add_done_callback(lambda _: progress.advance())

    def get(self, entry: Element) -> tuple[EncodedPicture, Callable[[], Picture]]:
        """An image's content, and what decodes it. Raises SceneError, as decoding does."""
        if entry in self._begun:
            return self._begun.pop(entry)
        encoded, open_picture = self._read(entry)
        return encoded, lambda: open_picture()()

    def _read(self, entry: Element) -> tuple[EncodedPicture, Callable[[], Callable[[], Picture]]]:
        """An image's content, and what opens it."""
        content: Any
        if "bufferView" in entry:
            content = self._document.view(entry)[0]
            self._document.take(entry, bytes=len(content))
        elif "uri" in entry:
            content = memoryview(self._document.resource(entry))
        else:
            raise entry.fault("has neither a uri nor a buffer view")
        uri = entry.text("uri", default="")
        label = f"{entry.place('uri')}: {shown(uri)}" if file_of(entry).name else entry.place()
        encoded = EncodedPicture(sha256(content).digest(), file_format(bytes(content[:12])))
        return encoded, partial(open_texture, content, label, self._document.budget.take_picture)


def file_of(entry: Element) -> PurePosixPath:
    """The file of an image; empty where it is embedded."""
    uri = entry.text("uri", default="")
    return _NO_FILE if not uri or uri.startswith("data:") else PurePosixPath(unquote(uri))
