"""Image-space helpers: refraction, caustics and ray bundles by the rasteriser."""
