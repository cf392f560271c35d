"""What a viewer says while a picture waits for shaders or unwrapped meshes."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial

from pica import compiling
from pica.texture_space import unwrap_progress


@contextmanager
def progress_told(say: Callable[[str], object]) -> Iterator[None]:
    """Call `say` with a line, such as "Compiling shaders: 7 of 17", within the block, in this thread."""

    def tell(what: str, done: int, total: int) -> None:
        say(f"{what}: {done:,} of {total:,}")

    with (
        compiling.REPORTS.to(partial(tell, "Compiling shaders")),
        unwrap_progress.REPORTS.to(partial(tell, "Unwrapping triangles")),
    ):
        yield
