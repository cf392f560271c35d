"""Checks the integrity of the database of compiled shaders, before anything opens it.

Slang-RHI keeps shaders in LMDB, which maps the file into memory and trusts it: a page beyond the file's end
crashes the process (SIGBUS), and so may one with invalid content. So all pages that are
reachable from the newest state are checked, except for the shaders' content. The format is LMDB 0.9's (mdb.c: MDB_page,
MDB_meta, MDB_db, MDB_node).
"""

import struct
import warnings
from os import SEEK_END
from pathlib import Path
from typing import BinaryIO, NamedTuple

_FILES = Path("rhi", "data.mdb"), Path("rhi", "lock.mdb")
_MAGIC, _VERSION = 0xBEEFC0DE, 1
_PAGE = struct.Struct("<QHHHH")  # number, padding, flags, end of the offsets of nodes, start of the nodes
_LONG_PAGE = struct.Struct("<QHHI")  # number, padding, flags, count of pages
_META = struct.Struct("<IIQQ48s48sQQ")  # magic, version, address, map size, two databases, last page, transaction
_DATABASE = struct.Struct("<IHHQQQQQ")  # page size or 0, flags, depth, branches, leaves, long pages, entries, root
_NODE = struct.Struct("<HHHH")  # low and high half of the size, flags, size of the key
_BRANCH, _LEAF, _LONG = 1, 2, 4  # flags of pages
_ON_LONG_PAGES, _IS_DATABASE = 1, 2  # flags of nodes
_EMPTY = 2**64 - 1  # as a root
_PAGE_SIZES = [1 << bits for bits in range(9, 17)]
_ATTEMPTS = 4


def mend(folder: Path) -> None:
    """Remove a damaged database from the folder that Slang-RHI is given, with a warning.

    Raises OSError where the files cannot be opened for writing, or not be removed.
    """
    files = [folder / name for name in _FILES]
    for file in files:
        if file.exists():
            file.open("r+b").close()
    if files[0].exists() and not is_whole(files[0]):
        for file in files:
            file.unlink(missing_ok=True)
        warnings.warn(f"{files[0]} is damaged and was removed: shaders are compiled anew", stacklevel=5)


def is_whole(file: Path) -> bool:
    """Whether an LMDB database can be read and appended to. An empty file is a new database."""
    failed = -1
    for _ in range(_ATTEMPTS):
        with file.open("rb", buffering=0) as opened:
            state = _newest_state(opened)
            if state is None:
                return not file.stat().st_size
            if state.transaction == failed:
                return False
            try:
                for root in state.roots:
                    _check(opened, state.page_size, root)
                return True
            except (_DamageError, struct.error):
                failed = state.transaction  # or it was written meanwhile: check again
    return True


class _DamageError(Exception):
    pass


class _State(NamedTuple):
    transaction: int
    page_size: int
    roots: list[int]


def _newest_state(file: BinaryIO) -> _State | None:
    """The newer of two alternating meta pages; None if either is invalid."""
    states = []
    page_size = 0
    for number in range(2):
        file.seek(number * page_size + _PAGE.size)
        try:
            magic, form, _, _, *databases, _, transaction = _META.unpack(file.read(_META.size))
        except struct.error:
            return None
        unpacked = [_DATABASE.unpack(database) for database in databases]
        page_size = unpacked[0][0]
        if (magic, form) != (_MAGIC, _VERSION) or page_size not in _PAGE_SIZES:
            return None
        states.append(_State(transaction, page_size, [database[-1] for database in unpacked]))
    return max(states)


def _check(file: BinaryIO, page_size: int, root: int) -> None:
    """Raises _DamageError or struct.error unless all below a root is as it must be."""

    pages = file.seek(0, SEEK_END) // page_size

    def page(number: int) -> bytes:
        if number >= pages:
            raise _DamageError
        file.seek(number * page_size)
        return file.read(page_size)

    waiting = [] if root == _EMPTY else [root]
    visited: set[int] = set()
    while waiting:
        number = waiting.pop()
        content = page(number)
        stated, _, kind, end, start = _PAGE.unpack_from(content)
        if number in visited or stated != number or kind not in (_BRANCH, _LEAF) or not end <= start <= page_size:
            raise _DamageError
        visited.add(number)
        for place in struct.unpack_from(f"<{(end - _PAGE.size) // 2}H", content, _PAGE.size):
            low, high, flags, key_size = _NODE.unpack_from(content, place)
            if kind == _BRANCH:
                waiting.append(low | high << 16 | flags << 32)
                continue
            size, value = low | high << 16, place + _NODE.size + key_size
            if flags & _ON_LONG_PAGES:
                (first,) = struct.unpack_from("<Q", content, value)
                count = -(-(_PAGE.size + size) // page_size)
                if _LONG_PAGE.unpack_from(page(first)) != (first, 0, _LONG, count):
                    raise _DamageError
                page(first + count - 1)
            elif value + size > page_size:
                raise _DamageError
            elif flags & _IS_DATABASE:
                waiting += [below for below in _DATABASE.unpack_from(content, value)[-1:] if below != _EMPTY]
