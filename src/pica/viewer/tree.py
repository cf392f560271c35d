"""The nodes of a scene as lines of text, each below its parent."""

from pica.scene.model import Scene
from pica.scene.node import Node

MOST = 1000
"""Lines: pages become slow beyond that."""
_INDENT = "\u2003"


def tree_lines(scene: Scene, most: int = MOST) -> dict[str, Node]:
    """The first `most` nodes by their lines, which are distinct and indented by depth; parents before children."""
    lines: dict[str, Node] = {}
    stack = [(node, 0) for node in reversed(scene.roots)]
    while stack and len(lines) < most:
        node, depth = stack.pop()
        name = _INDENT * depth + (node.name or "(no name)")
        count = 2
        line = name
        while line in lines:
            line, count = f"{name} ({count})", count + 1
        lines[line] = node
        stack += [(child, depth + 1) for child in reversed(node.children)]
    return lines
