"""Web: pages that trace rays in a browser with the tracer's GLSL programs, in WebGL 2."""
