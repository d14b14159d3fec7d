"""ProgramView: the GLSL text of the program that the viewer's method runs."""
from __future__ import annotations

from typing import TYPE_CHECKING

from ..inspect.traced_programs import traced_programs

if TYPE_CHECKING:
    from .model import Viewer


class ProgramView:
    """The text that `gpgpu-rt program` would print for the viewer's method, options and scene.

    Attributes
    ----------
    shown : whether the viewer shows the text
    title : method and number of lines
    lines : the text
    """

    def __init__(self) -> None:
        self.shown, self.title, self.lines = False, "program", list[str]()
        self._of: tuple[object, ...] | None = None

    def update(self, viewer: Viewer) -> None:
        """Compile the programs and store their text, if the text is shown and outdated.

        Call this between frames, because it runs passes.
        """
        selection = viewer.selection
        asked = id(viewer.scene), selection.method, repr(selection.options)
        if not self.shown or asked == self._of:
            return
        self._of, self.lines, self.title = asked, [], f"program of {selection.method}"
        try:
            programs = [one for one in traced_programs(
                selection.method, {**selection.options, "context": viewer.gpu}, viewer.scene)
                if one.traverses]
        except Exception as failure:
            viewer.tell(failure)
            return
        self.lines = "\n".join(one.text for one in programs).splitlines()
        self.title = f"{self.title}: {len(self.lines)} lines"
