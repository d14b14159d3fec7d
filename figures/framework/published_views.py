"""Published views: scenes whose data set publishes the camera that our images use.

The survey does not state the views of the papers' images. If a data set publishes a view, the
paper probably used this view. This project chooses the lights of all scenes itself
(``gpgpu_rt/scene/``), so no shadow rays come from published data.
"""
from __future__ import annotations

VIEWS = {"cornell": "Cornell University's published data", "kitchen": "BART's camera at t = 0",
         "robots": "BART's camera at t = 0"}
