"""A moving picture as the bytes of a file."""

import io
from dataclasses import dataclass

from PIL import Image


@dataclass(frozen=True)
class Gif:
    """A GIF.

    Attributes:
        content: bytes of the file.
    """

    content: bytes

    @property
    def width(self) -> int:
        """Of a picture [pixels]."""
        return self._size[0]

    @property
    def height(self) -> int:
        """Of a picture [pixels]."""
        return self._size[1]

    @property
    def _size(self) -> tuple[int, int]:
        with Image.open(io.BytesIO(self.content)) as image:
            return image.size
