"""Files that pages are sent, which the browser saves."""

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from pica.images.pictures import encoded_png
from pica.viewer.view import View
from pica.viewer.viewer import Viewer

if TYPE_CHECKING:
    import viser

File = tuple[str, bytes]
"""Name and content."""


def picture_file(viewer: Viewer, view: View) -> File:
    """What is shown of a view, as a .png."""
    return f"{viewer.shown}.png", encoded_png(viewer.render_full(view).pixels)


def frame_file(viewer: Viewer, view: View) -> File:
    """Radiance and all AOVs of a view, as an .exr."""
    frame = viewer.frame(view)
    with TemporaryDirectory(prefix="pica-") as folder:
        path = Path(folder) / "frame.exr"
        frame.save(path)
        return path.name, path.read_bytes()


def path_file(viewer: Viewer, _: View) -> File:
    """The recorded cameras, for `--camera-path`."""
    return "cameras.json", viewer.path.file()


def send(client: "viser.ClientHandle", file: File) -> None:
    """Send a file to a page."""
    client.send_file_download(*file, save_immediately=True)
