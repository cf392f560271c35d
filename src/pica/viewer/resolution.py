"""How large the next picture is: small while something moves, so that pictures arrive in time, and whole at rest."""

Size = tuple[int, int]
"""(width, height) in pixels."""

_DIVISORS = (1, 1.5, 2, 3, 4, 6, 8, 12, 16)
"""Pixels of the whole picture to one that is rendered, along each side."""
_ROOM = 0.8
"""Share of the allowed time that a finer picture may be expected to take, so that sizes do not alternate."""
_NEW = 0.5
"""Weight of the newest measurement."""
_LEAST = 32
"""Pixels of a picture, along its shorter side."""
_GROWTH = 4
"""Times as many pixels as the picture before, at rest."""
_LONGEST = 4096
"""Pixels of a picture, each way."""


class Resolution:
    """Chooses the sizes of one view's pictures by the time that they take."""

    def __init__(self, full: Size, seconds: float = 0.1) -> None:
        """`full`: the whole picture. `seconds`: that a picture may take while something moves."""
        self.seconds = seconds
        self._full = full
        self._divisor = self._moving = self._coarsest
        self._measured: float | None = None
        """Seconds of a picture in motion."""
        self._newest = 0.0
        """Seconds of the newest picture."""

    @property
    def full(self) -> Size:
        """The whole picture."""
        return self._full

    @full.setter
    def full(self, size: Size) -> None:
        if size != self._full:
            self._full, self._measured = size, None
            self._divisor = self._moving = self._coarsest

    @property
    def is_full(self) -> bool:
        """Whether the next picture is whole."""
        return self._divisor == 0

    @property
    def size(self) -> Size:
        """Of the next picture."""
        width, height = self._full
        return max(1, round(width / _DIVISORS[self._divisor])), max(1, round(height / _DIVISORS[self._divisor]))

    @property
    def finer_seconds(self) -> float:
        """What the picture after `rest` may be expected to take."""
        return self._newest * self._pixels(self._divisor, self._finer)

    def move(self) -> None:
        """The next picture is one in motion."""
        self._divisor = self._moving

    def rest(self) -> None:
        """Nothing moves: the next picture is finer than the one before, up to the whole one."""
        self._divisor = self._finer

    def measure(self, seconds: float, *, begins: bool = False) -> None:
        """A picture of the current size took so long. `begins`: it is the first without a history, which takes longer
        than those that follow in motion."""
        self._newest = seconds
        if self._divisor != self._moving or begins:
            return
        before = self._measured
        now = self._measured = seconds if before is None else before + _NEW * (seconds - before)
        wanted = self._moving
        if now > self.seconds:
            while wanted < self._coarsest and now * self._pixels(self._moving, wanted) > _ROOM * self.seconds:
                wanted += 1
        else:
            while wanted > 0 and now * self._pixels(self._moving, wanted - 1) <= _ROOM * self.seconds:
                wanted -= 1
        if wanted != self._moving:
            self._moving, self._measured = wanted, None

    @property
    def _finer(self) -> int:
        near = (number for number in range(self._divisor) if self._pixels(self._divisor, number) <= _GROWTH)
        return next(near, max(self._divisor - 1, 0))

    @property
    def _coarsest(self) -> int:
        fitting = [number for number, divisor in enumerate(_DIVISORS) if min(self._full) / divisor >= _LEAST]
        return fitting[-1] if fitting else 0

    def _pixels(self, before: int, after: int) -> float:
        """How many times as many pixels pictures of another divisor have."""
        return (_DIVISORS[before] / _DIVISORS[after]) ** 2


def fitted(canvas: Size, size: Size) -> Size:
    """The size of pictures for a canvas: its shape, with at most as many pixels as `size` has, nor more than it has."""
    width, height = (min(length, _LONGEST) for length in canvas)
    scale = min(1.0, (size[0] * size[1] / (width * height)) ** 0.5)
    return max(1, round(width * scale)), max(1, round(height * scale))
