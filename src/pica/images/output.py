"""A rendered frame: the picture, its AOVs, and its cost."""

from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from pica.color import srgb_encode
from pica.errors import PicaError, shown
from pica.images import pictures
from pica.images.aov_table import AOVS, AovInfo, aov_info
from pica.images.frame_html import THUMBNAIL, frame_html
from pica.images.labels import BACKGROUND, Labels, MaterialLabel, NodeLabel, Semantic
from pica.names import did_you_mean

if TYPE_CHECKING:
    from torch import Tensor

    from pica.scene.node import Node

Lazy = Callable[[], NDArray[Any]]

_PICTURES = ("color", "display")
_VECTORS = ("normal", "geometric_normal", "tangent", "position", "motion")
"""AOVs with channels X, Y and Z."""


class Frame:
    """A rendered picture with its arbitrary output variables (AOVs): the G-buffer and the buffers of the effects.

    Arrays are fetched from the device at first use, once; do not write into them. A frame can be pickled, which
    fetches all of them, and has a preview in notebooks.
    """

    BACKGROUND: ClassVar[int] = BACKGROUND
    """The number of the background in `instance`, `material` and semantic labels."""

    def __init__(
        self,
        size: tuple[int, int],
        color: Lazy | None,
        display: Lazy | None,
        aovs: Mapping[str, Lazy],
        timings: Mapping[str, float],
        labels: Labels | None = None,
        device: str = "",
        tensors: Mapping[str, Callable[[], Any]] | None = None,
    ) -> None:
        """Take functions that return (height, width, 3) float32 radiance and (height, width, 3) uint8 for display, None
        without a picture; one (height, width) or (height, width, channels) array for each AOV; the names of the numbers
        in the AOVs instance and material; functions that make tensors on a graphics card, by "color", "display" or the
        AOV's name; the rest as below.
        """
        self.size = size
        """(width, height) in pixels."""
        self.device = device
        """The name of the device."""
        self.timings: dict[str, float] = dict(timings)
        """GPU milliseconds of every pass, by name."""
        pictures = {"/color": color, "/display": display}
        self._sources: dict[str, Lazy] = {**{name: fetch for name, fetch in pictures.items() if fetch}, **aovs}
        self._arrays: dict[str, NDArray[Any]] = {}
        self._aov_names = tuple(aovs)
        self._labels = labels
        self._tensor_sources = dict(tensors or {})
        self._tensors: dict[str, Any] = {}

    @property
    def color(self) -> NDArray[np.float32]:
        """(height, width, 3) linear Rec. 709 radiance of the scene in nits, no exposure applied; premultiplied by the
        AOV "alpha" where the background is transparent. Raises PicaError for a frame of labels alone."""
        return self._array("/color")

    @property
    def display(self) -> NDArray[np.uint8]:
        """(height, width, 3) sRGB, exposed and tone mapped; straight where the background is transparent."""
        return self._array("/display")

    @property
    def aov_names(self) -> tuple[str, ...]:
        """The names for `aov`, in the order of the frame."""
        return self._aov_names

    def aov(self, name: str) -> NDArray[Any]:
        """One buffer: (height, width) for scalars and ids, (height, width, channels) for vectors and colours.

        Raises PicaError for an unknown name, with the available ones.
        """
        self._check_aov(name)
        return self._array(name)

    def aov_info(self, name: str) -> AovInfo:
        """The content of a buffer: unit, channels, its value at the background, and its frame.

        Raises PicaError as `aov` does.
        """
        self._check_aov(name)
        return aov_info(name)

    def torch(self, name: str = "color") -> "Tensor":
        """A buffer as a PyTorch tensor with the shape of the array: "color", "display", or an AOV by its name.

        If PyTorch was imported before the first renderer was made and the frame is from an NVIDIA card, the tensor is
        on that card: the picture and the G-buffer's AOVs but position and uv get there without passing through host
        memory, others are uploaded. It has memory of its own, valid as long as the tensor is and the device is open,
        whatever becomes of the renderer and the frame.
        Elsewhere it is on the processor and shares the array's memory, without a copy. Each call returns the same
        memory: clone() before writing. Raises PicaError as `aov`, and where PyTorch is not installed.
        """
        key = self._key(name)
        torch = _torch()
        if key not in self._tensors:
            on_card = self._tensor_sources.get(name)
            if on_card is not None:
                self._tensors[key] = on_card()
            else:
                tensor = torch.from_numpy(self._array(key))
                self._tensors[key] = tensor.cuda() if self._tensor_sources else tensor
        return self._tensors[key]

    def dlpack(self, name: str = "color") -> Any:
        """A buffer for the `from_dlpack` of any library, such as JAX, CuPy or NumPy, under the conditions of `torch`.

        It is on a card only where `torch` puts it there; without PyTorch it is the array. Raises PicaError as `aov`.
        """
        return self.torch(name) if name in self._tensor_sources else self._array(self._key(name))

    def __dlpack__(self, **requested: Any) -> Any:
        return self.dlpack().__dlpack__(**requested)

    def __dlpack_device__(self) -> tuple[int, int]:
        kind, number = self.dlpack().__dlpack_device__()
        return int(kind), int(number)

    @property
    def ids(self) -> dict[int, NodeLabel]:
        """All nodes of the scene by their number in the AOV `instance`, with name, path, mesh, materials and `extras`
        as they were in this frame; parents before children. Number 0, the background, is not among them."""
        return self._known_labels().nodes

    @property
    def material_ids(self) -> dict[int, MaterialLabel]:
        """The materials by their number in the AOV `material`."""
        return self._known_labels().materials

    def mask(self, node: "str | Node | NodeLabel") -> NDArray[np.bool_]:
        """(height, width) where a node or one of its descendants is visible.

        `node`: one of the scene's, a value of `ids`, or a name or the end of a path: "hand" and "arm/hand" match
        "robot/arm/hand", and all others that end so; "/robot" matches root nodes only. Raises PicaError,
        with near names, if there is none.
        """
        return self._known_labels().mask(self.aov("instance"), node)

    def semantic(
        self, classes: "str | Callable[[NodeLabel], str | None]", names: Sequence[str] | None = None
    ) -> Semantic:
        """The semantic class of each pixel: `labels`, (height, width) int32, and `names`, their table.

        `classes`: the key of a node's class in `extras`, or a function from a value of `ids` to its class.
        Nodes without one (None) inherit that of their parent. 0 is "background", without a surface or a
        class; a key that no node has is a warning. `names`: the table, from 1 on, which keeps numbers the same in all
        scenes; None sorts the classes of the scene's nodes. Raises PicaError for a class that is not in `names`, or is
        neither text nor a whole number.
        """
        return self._known_labels().semantic(self.aov("instance"), classes, names)

    def save(self, path: str | Path, aovs: Sequence[str] | None = None) -> None:
        """Write the picture: .png the display picture, .exr the radiance as R, G, B and AOVs as named channels.

        With a transparent background (visibility.background) there is alpha: A in an .exr, where colours are
        premultiplied, and straight in a .png.

        `aovs` chooses the AOVs of an .exr, None for all. Their channels are depth.Z, X, Y, Z for directions, places and
        motion (normal.X), U, V for texture coordinates, R, G, B, A for colours (albedo.R), the bare name for other
        scalars (instance), and numbers where there are more than four (shadows.0). pica.read_exr reads them.
        Raises PicaError for another suffix, an unknown AOV or a folder that cannot be written.
        """
        suffix = Path(path).suffix.lower()
        if suffix == ".png":
            alpha = [np.round(self.aov("alpha")[..., None] * 255).astype(np.uint8)] if self._has_alpha else []
            pictures.write_png(path, np.concatenate([self.display, *alpha], axis=-1))
        elif suffix == ".exr":
            channels = _channels("", self.color)
            if self._has_alpha:
                channels["A"] = self.aov("alpha").astype(np.float32)
            for name in [name for name in self.aov_names if name != "alpha"] if aovs is None else aovs:
                channels |= _channels(name, self.aov(name))
            pictures.write_exr(path, channels)
        else:
            raise PicaError(f"cannot write {path}: the name must end in .png or .exr")

    def save_aov(self, name: str, path: str | Path, exact: bool = False) -> None:
        """Write one AOV: .png a picture to look at (see `preview`), .exr and .npy its values.

        `exact`: a .png too holds the values, which must be whole numbers of at most 65535, as 16-bit grey. Raises
        PicaError for others, and as `save` does.
        """
        suffix = Path(path).suffix.lower()
        if suffix not in (".png", ".exr", ".npy"):
            raise PicaError(f"cannot write {path}: the name of an AOV's file must end in .png, .exr or .npy")
        array = self.aov(name)
        if suffix == ".exr":
            pictures.write_exr(path, _channels(name, array))
        elif exact or suffix == ".npy":
            pictures.write_labels(path, array)
        else:
            pictures.write_png(path, preview(name, array))

    def __repr__(self) -> str:
        width, height = self.size
        where = f" on {self.device}" if self.device else ""
        names = ", ".join(self._aov_names) or "none"
        return f"<pica.Frame {width}x{height}{where}, {sum(self.timings.values()):.3g} ms of passes, AOVs: {names}>"

    def _repr_png_(self) -> bytes | None:
        return pictures.encoded_png(self.display) if self._has("/display") else None

    def _repr_html_(self) -> str:
        display = self.display if self._has("/display") else None
        return frame_html(display, ((name, self._thumbnail(name)) for name in self._aov_names))

    def _thumbnail(self, name: str) -> NDArray[np.uint8]:
        """A small picture of an AOV, which is fetched again if nobody has asked for it before: kept for all AOVs, it
        would fill the memory of a notebook."""
        array = self._arrays[name] if name in self._arrays else self._sources[name]()
        step = -(-max(self.size) // THUMBNAIL)
        return preview(name, array[step // 2 :: step, step // 2 :: step])

    def __getstate__(self) -> dict[str, Any]:
        for name in self._sources:
            self._array(name)
        return vars(self) | {"_sources": {}, "_tensor_sources": {}, "_tensors": {}}

    def _key(self, name: str) -> str:
        if name in _PICTURES:
            return f"/{name}"
        self._check_aov(name)
        return name

    def _check_aov(self, name: str) -> None:
        if name not in self._aov_names:
            there = ", ".join(self._aov_names) or "none"
            kind = AOVS.get(name) if isinstance(name, str) else None
            ask = f"; render(aovs=[{name!r}]) makes it" if kind and kind.on_request else ""
            ask = ask or did_you_mean(name, self._aov_names)
            raise PicaError(f"no AOV {shown(name)} in this frame; there are {there}{ask}")

    def _known_labels(self) -> Labels:
        if self._labels is None:
            raise PicaError("this frame names nothing: render(aovs=[...]) left out instance and material")
        return self._labels

    @property
    def _has_alpha(self) -> bool:
        return "alpha" in self._aov_names

    def _has(self, key: str) -> bool:
        return key in self._sources or key in self._arrays

    def _array(self, key: str) -> NDArray[Any]:
        if not self._has(key):
            raise PicaError("this frame has labels and no picture; Renderer.render gives both")
        if key not in self._arrays:
            self._arrays[key] = self._sources[key]()
        return self._arrays[key]


def _torch() -> Any:
    try:
        return import_module("torch")
    except ImportError:
        raise PicaError("frame.torch: PyTorch is not installed; pip install torch") from None


def _channels(name: str, values: NDArray[Any]) -> dict[str, NDArray[Any]]:
    """The channels of an AOV in an .exr; of the picture without a name."""
    if values.ndim == 2:
        return {f"{name}.Z" if name == "depth" else name: values}
    letters = "XYZW" if name in _VECTORS else "UV" if name == "uv" else "RGBA"
    count = values.shape[2]
    names = letters if count <= len(letters) else map(str, range(count))
    prefix = f"{name}." if name else ""
    return {prefix + part: values[..., channel] for channel, part in zip(range(count), names, strict=False)}


def preview(name: str, array: NDArray[Any]) -> NDArray[np.uint8]:
    """An AOV as a picture for viewing, (height, width, 3) uint8.

    Integers: a colour for each id. Directions: -1 to 1 becomes black to white. Motion: grey is none, full colour the
    largest, or a pixel if all is less. Depth: near is light. Positions: black to white along each axis, over all
    visible surfaces. Texture coordinates: modulo 1. Other scalars: black to white. Colours: sRGB,
    divided by their largest value above 1.
    """
    values = array[..., None] if array.ndim == 2 else array
    if values.dtype.kind in "iu":
        # Multiplicative hashing (Knuth, The Art of Computer Programming, volume 3, section 6.4), a byte a channel.
        hashed = values[..., :1].astype(np.uint64) * np.array([2654435761, 2246822519, 3266489917], np.uint64)
        return ((hashed >> np.uint64(16)) & np.uint64(255)).astype(np.uint8)
    if name == "position":
        low, high = _range_of(values)
        values = (values - low) / np.maximum(high - low, 1e-30)
    elif name == "uv":
        values = values - np.floor(np.where(np.isfinite(values), values, 0))
    values = np.where(np.isfinite(values), values, 0).astype(np.float32)[..., :3]
    largest = float(np.abs(values).max(initial=0))
    if name == "motion":
        values = 0.5 + 0.5 * values / max(largest, 1.0)
    elif name in _VECTORS and name != "position":
        values = 0.5 + 0.5 * values
    elif name == "depth":
        lit = values > 0
        near = float(values[lit].min()) if lit.any() else 1.0
        values = np.where(lit, near / np.maximum(values, near), 0)
    else:
        values = values / max(largest, 1.0)
        if values.shape[2] == 3:
            values = srgb_encode(values)
    picture = np.full((*values.shape[:2], 3), 0.5 if name == "motion" else 0.0, np.float32)
    picture[..., : values.shape[2]] = values
    if values.shape[2] == 1:
        picture[:] = values
    return (np.clip(picture, 0, 1) * 255 + 0.5).astype(np.uint8)


def _range_of(values: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """The lowest and the highest value of each channel, without NaN."""
    seen = values[np.isfinite(values).all(axis=-1)]
    return seen.min(axis=0, initial=np.inf), seen.max(axis=0, initial=-np.inf)
