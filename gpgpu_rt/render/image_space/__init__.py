"""Image-space helpers: refraction, caustics and ray bundles that use the rasteriser."""
