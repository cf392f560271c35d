"""The process that converts one file, which `process.py` starts.

The request on standard input is JSON. The reply is the length of its JSON, its JSON with warnings or the fault, and the
content of a .glb.
"""

import json
import os
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

from pica.errors import SceneError
from pica.scene.conversion.conversion import Conversion, CountingBudget
from pica.scene.conversion.formats import FORMATS
from pica.scene.limits import Limits

LENGTH_BYTES = 4
"""Of the length before JSON, little-endian."""


def main() -> None:
    """Answer the request on standard input."""
    sys.modules["scipy"] = None  # type: ignore[assignment]  # trimesh would import it, which takes as long as all else
    replies = os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # libraries print
    request = json.loads(sys.stdin.buffer.read())
    answer, content = _answer(request)
    text = json.dumps(answer).encode()
    replies.write(len(text).to_bytes(LENGTH_BYTES, "little") + text)
    replies.write(content)
    replies.flush()
    os._exit(0)  # libraries need not tidy up


def _answer(request: dict[str, Any]) -> tuple[dict[str, Any], bytes]:
    path = Path(request["path"])
    converter = import_module(FORMATS[path.suffix.lower()].converter)
    converter.import_libraries(path)  # before the limits, which are for the file
    try:
        budget = CountingBudget(Limits(**request["limits"]))
        conversion = Conversion(path, budget, request["allow_outside"], request["up"])
        converter.convert(conversion)
        content = conversion.asset.content()
    except SceneError as error:
        return {"fault": str(error)}, b""
    except MemoryError:
        return {"fault": "takes more memory to read than its bytes account for"}, b""
    except Exception as error:  # of the libraries, of any kind
        return {"fault": f"cannot be read as {path.suffix.lower()} ({converter.described(error)})"}, b""
    files = [[*key, length] for key, length in budget.files.items() if isinstance(key, tuple)]
    return {"warnings": conversion.warnings, "files": files, "size": len(content)}, content


if __name__ == "__main__":
    main()
