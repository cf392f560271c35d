"""The README of a data set: its files, units and conventions."""

from collections.abc import Sequence

_ROWS = {
    "depth": ("depth.npy", "metres along the view axis, infinity at the background", "float32 (height, width)"),
    "normal": (
        "normal.npy",
        "unit normals in the world, with normal maps; 0 at the background",
        "float16 (height, width, 3)",
    ),
    "instance": ("instance.png", "number of the node, see `nodes.json`; 0 at the background", "16 bits"),
    "semantic": ("semantic.png", "number of the category, from 1; 0 without one", "16 bits"),
    "motion": (
        "motion.npy",
        "pixels right and down to where the surface was at `camera_before`",
        "float32 (height, width, 2)",
    ),
    "albedo": ("albedo.png", "base colour, sRGB; black at the background", "8 bits"),
}
"""The end of the file's name, its content and its type, by label."""
_TEXT = """# Data set

Rendered by pica. `dataset.json` has the arguments, `nodes.json` the categories and the paths of nodes by
instance number.

## Files

| file | content |
|---|---|
| `shards/NNNNNN.tar` | samples, for WebDataset |
| `images/NNNNNN.png`, `annotations.json` | pictures and instances, for COCO's loaders |

A sample in a shard:

| file | content | type |
|---|---|---|
| `NNNNNN.png` | the picture, sRGB, tone mapped | 8 bits |
{rows}
| `NNNNNN.json` | cameras, time, instances | |

## Conventions

* The world is right-handed with +Y up, in metres. Rows count down, columns right, from the upper left pixel.
* `camera.intrinsics` is OpenCV's K, null for an orthographic camera. Whole numbers are pixel centres. There is no
  distortion.
* `camera.pose_opencv` and `pose_opengl` are camera to world, (4, 4). OpenCV's camera looks along +Z with +Y down,
  OpenGL's along -Z with +Y up. The inverse of `pose_opencv` is OpenCV's [R|t].
* `camera_before` is the camera of the picture before it on a path. Without a path it is `camera`, and motion is that of
  objects within 1/30 s.
* An instance is a node of the scene. `bbox` is left, top, width, height in pixels; `segmentation` is uncompressed
  run-length encoding.
* A category is `class` among the extras of a node or of one above it. In a scene without classes it is the name of the
  node without the number at its end.

## Loading

```python
import glob, webdataset
from pycocotools.coco import COCO

for sample in webdataset.WebDataset(sorted(glob.glob("shards/*.tar")), shardshuffle=False).decode("rgb8"):
    picture, camera = sample["png"], sample["json"]["camera"]

coco = COCO("annotations.json")
mask = coco.annToMask(coco.anns[1])
```
"""


def readme(labels: Sequence[str]) -> str:
    """The text for a data set with these labels."""
    rows = (f"| `NNNNNN.{end}` | {content} | {kind} |" for end, content, kind in (_ROWS[name] for name in labels))
    return _TEXT.format(rows="\n".join(rows))
