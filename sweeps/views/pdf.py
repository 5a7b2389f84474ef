"""Pages of PDF on which a picture stands larger or smaller than it was laid out."""

from pathlib import Path

from matplotlib.backends.backend_pdf import Op, PdfFile, PdfPages


class _ScaledFile(PdfFile):
    scale = 1.0

    def newPage(self, width, height):
        """A page of the scaled size, on which all that follows is scaled."""
        super().newPage(width * self.scale, height * self.scale)
        self.output(self.scale, 0, 0, self.scale, 0, 0, Op.concat_matrix)


class ScaledPages(PdfPages):
    """A file of one page.

    Args:
        path: of the file.
        scale: of everything on it.
    """

    def __init__(self, path: Path, scale: float):
        super().__init__(path)
        self._path, self._scale = path, scale

    def _ensure_file(self):
        if self._file is None:
            self._file = _ScaledFile(self._path)
            self._file.scale = self._scale
        return self._file
