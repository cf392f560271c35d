"""Makes all programs that a first frame needs: those that no cache has are compiled by a process per core.

Workers (compiler.py) store their results in the caches on disk. This process then links and makes each from there,
and compiles the rest.
"""

import os
from collections.abc import Callable, Sequence
from queue import Empty
from typing import Any

from pica import compiling
from pica.programs.compiler import Task, Workers
from pica.programs.library import programs
from pica.programs.machine_code import make_machine_code
from pica.programs.material_types import MaterialTypeSet, made
from pica.programs.scene_features import BUNDLES, supported_features, with_features
from pica.rhi.device import Device
from pica.rhi.recipes import Recipe

Program = tuple[Recipe[Any], MaterialTypeSet]
"""A recipe and its variant, the arguments of `Device.product`."""
_MOST_WORKERS = 8
"""More would only wait for the longest program, with some 300 MB each."""


def prepare(device: Device, types: MaterialTypeSet) -> MaterialTypeSet:
    """Make the missing programs of all passes on this device; `types`: for passes that depend on material types.

    Returns the types that they were made for: with more features if the caches have all programs for those, and not for
    `types`. Programs that no cache has are reported to `compiling.REPORTS`, or logged. Raises DeviceError for one
    that does not compile.
    """
    compiled = programs(device).compiled
    types = _covering(device, types)
    required = _required(device, types)
    missing = {program for program in required if not compiled.has(program)}
    if missing:
        _compile(device, [program for program in required if program in missing])
    for program in required:
        made(device, *program)
    return types


def _covering(device: Device, types: MaterialTypeSet) -> MaterialTypeSet:
    compiled = programs(device).compiled
    for bundle in BUNDLES:
        if supported_features(types).issubset(bundle.features):
            more = with_features(types, frozenset(bundle.features))
            if all(map(compiled.has, _required(device, more))):
                return more
    return types


def _required(device: Device, types: MaterialTypeSet) -> list[Program]:
    """The slowest to compile first, for balance: programs late in a frame are the largest."""
    following = [user.recipe for user in programs(device).for_types if not (user.types or user.is_replaced)]
    required: list[Program] = [(recipe, types) for recipe in reversed(following)]
    required += [(recipe, ()) for recipe in (*programs(device).planned_for(types), *device.planned)]
    return [program for program in dict.fromkeys(required) if not device.has(*program)]


def expect(device: Device) -> None:
    """If the caches are empty, start the workers of the first `prepare`: their start takes as long as this process's
    setup of the stages."""
    library = programs(device)
    if library.compiled.empty and library.first_workers is None and device.cache is not None and cores() > 1:
        library.first_workers = workers = Workers(device.name, device.cache, min(cores(), _MOST_WORKERS))
        device.at_close(workers.close)
        workers.start()


def _compile(device: Device, missing: Sequence[Program]) -> None:
    """Compile these by workers, and the rest here."""
    compiled, compilation = programs(device).compiled, compiling.Compilation(len(missing))
    left = set(missing)

    def on_compiled(program: Program) -> None:
        compiled.add([program])
        left.discard(program)
        compilation.tell(len(missing) - len(left))

    _compile_beside(device, missing, on_compiled, compilation.log_once)
    for program in missing:
        if program in left:
            make_machine_code(device, made(device, *program))
            on_compiled(program)


def _compile_beside(
    device: Device, missing: Sequence[Program], on_compiled: Callable[[Program], None], late: Callable[[], None]
) -> None:
    """Have workers compile these, ignoring their faults; `on_compiled` is called for each that the caches have now.

    `late` is called if one is slow.
    """
    library, count = programs(device), min(cores(), len(missing), _MOST_WORKERS)
    workers, library.first_workers = library.first_workers, None
    if workers is None:
        if count < 2 or device.cache is None:
            return
        workers = Workers(device.name, device.cache, count)
        workers.start()
    try:
        workers.give([Task(*program) for program in missing])
        for _ in missing:
            task = _next(workers, late)
            if task.answered and task.fault is None:
                on_compiled((task.recipe, task.types))
    except BaseException:
        workers.close()
        raise


def _next(workers: Workers, late: Callable[[], None]) -> Task:
    """The next task that is done."""
    try:
        return workers.heard.get(timeout=compiling.LONG)
    except Empty:
        late()
        return workers.heard.get()


def cores() -> int:
    """How many this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
