"""Web: pages that trace rays in a browser, by the tracer's GLSL programs, in WebGL 2."""
