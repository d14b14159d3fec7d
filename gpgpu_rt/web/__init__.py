"""Web: pages that trace rays in a browser, by the same programs in WebGL 2."""
