"""Sessions: build a method's accelerator over a scene, trace rays through it and draw pictures."""
