"""The process that decodes Draco, which `draco.py` starts by the path of this file: none of pica is imported.

A request is the length of its JSON, its JSON, and the compressed bytes. The reply is the length of its JSON, its JSON
with the counts or the fault, and then the indices and the attributes as the request names them.
"""

import json
import os
import signal
import sys
import time
from collections.abc import Callable
from typing import Any, BinaryIO

import numpy as np

LENGTH_BYTES = 4
"""Of the length before JSON, little-endian."""


Decode = Callable[[bytes], Any]


class UnfitError(Exception):
    """What is wrong with the content, in one line."""


def main() -> None:
    """Answer requests on standard input until it ends."""
    import DracoPy  # here, since loading any file imports this module; before the limits, which are of the decoding

    replies = os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # the library prints
    requests = sys.stdin.buffer
    while head := requests.read(LENGTH_BYTES):
        request = json.loads(requests.read(int.from_bytes(head, "little")))
        _reply(replies, DracoPy.decode, request, requests.read(request["bytes"]))


def _reply(replies: BinaryIO, decode: Decode, request: dict[str, Any], content: bytes) -> None:
    arrays: list[np.ndarray[Any, Any]] = []
    start = time.process_time()
    try:
        _set_limits(request["memory"], request["seconds"])
        arrays = _decoded(decode, request, content)
        seconds = time.process_time() - start
        answer: dict[str, Any] = {"corners": arrays[0].size, "vertices": len(arrays[1]), "seconds": seconds}
    except UnfitError as error:
        answer = {"fault": str(error)}
    except MemoryError:
        answer = {"fault": "takes more memory to decode than its accessors account for"}
    except Exception as error:  # of the library: FileTypeException, ValueError and others
        answer = {"fault": f"cannot be decoded ({error})"}
    text = json.dumps(answer).encode()
    replies.write(len(text).to_bytes(LENGTH_BYTES, "little") + text)
    if "fault" not in answer:
        for array in arrays:
            replies.write(np.ascontiguousarray(array).data)
    replies.flush()


def _set_limits(memory: int, seconds: float) -> None:
    """Bytes above what is in use, and processor time, after which the system ends this process."""
    if sys.platform == "win32":
        return
    import resource

    signal.setitimer(signal.ITIMER_PROF, seconds)
    if sys.platform == "linux":
        with open("/proc/self/statm", encoding="ascii") as file:
            pages = int(file.read().split()[0])
        _, hard = resource.getrlimit(resource.RLIMIT_AS)
        most = pages * resource.getpagesize() + memory
        resource.setrlimit(resource.RLIMIT_AS, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard))


def _decoded(decode: Decode, request: dict[str, Any], content: bytes) -> list[np.ndarray[Any, Any]]:
    """The indices, and an array for each requested attribute, of the requested types."""
    mesh = decode(content)
    faces = getattr(mesh, "faces", None)
    if faces is None:
        raise UnfitError("holds points without triangles")
    if faces.size > request["corners"]:
        raise UnfitError(f"holds {faces.size} indices, and its accessor {request['corners']}")
    arrays = [faces.astype("<u4", copy=False)]
    by_id = {attribute["unique_id"]: attribute["data"] for attribute in mesh.attributes}
    for number, width, kind in request["attributes"]:
        if number not in by_id:
            raise UnfitError(f"has no attribute {number}")
        values = by_id[number].reshape(len(by_id[number]), -1)
        if len(values) > request["vertices"] or len(values) != len(by_id[request["attributes"][0][0]]):
            raise UnfitError(f"holds {len(values)} vertices, and its accessors {request['vertices']}")
        if values.shape[1] != width:
            raise UnfitError(f"has {values.shape[1]} components in attribute {number}, and its accessor {width}")
        with np.errstate(all="ignore"):
            typed = values.astype(kind)
        if values.dtype != typed.dtype and not np.array_equal(typed, values):
            raise UnfitError(f"holds {values.dtype} in attribute {number}, which its accessor's type does not hold")
        arrays.append(typed)
    return arrays


if __name__ == "__main__":
    main()
