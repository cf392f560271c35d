"""The moves of a camera that user interfaces have buttons for."""

from collections.abc import Callable

from pica.viewer.camera_control import CameraControl
from pica.viewer.viewer import Viewer


def camera_moves(viewer: Viewer) -> dict[str, Callable[[CameraControl], object]]:
    """What each does with a camera of the viewer, by the text of its button."""

    def focus(control: CameraControl) -> None:
        if (point := viewer.focus) is not None:
            control.focus(point)

    return {"Home": CameraControl.home, "Frame all": CameraControl.frame_all, "Focus what is selected": focus}
