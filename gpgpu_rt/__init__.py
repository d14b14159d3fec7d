"""Ray tracing on graphics hardware, as fragment programs did it in 2002-2007."""
