"""Published views: lists scenes whose data set publishes the camera that our images use.

The survey does not state the papers' views; a paper probably used its scene's published view.
Lights are this project's own choice (``gpgpu_rt/scene/``), so no shadow rays come from published
data.
"""
from __future__ import annotations

VIEWS = {"cornell": "Cornell University's published data", "kitchen": "BART's camera at t = 0",
         "robots": "BART's camera at t = 0"}
