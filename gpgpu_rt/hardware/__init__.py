"""The hardware of 2002-2007: what fragment programs cost on the graphics cards of that time.

The modules compute the time of a program on a card, step by step:

* ``cards``: The figures of the cards, each with its source (``cards.json``), and their limits.
* ``compiler``: The instructions of a program, printed by Mesa's compiler. Its instructions work on
  four components, as on most of those cards. **Why a compiler and not the GLSL text**: the
  compiler merges repeated fetches and removes unused code.
* ``program``: These instructions as a tree of blocks, branches and loops, and the cost of each
  region of the tree.
* ``translate``, ``emulate``: An emulated fragment processor in numpy, which gives the renderer's
  results bit for bit. It counts the executed instructions for every SIMD width. **Why not counters
  in the shaders**: a counter shows how often a ray did something, but not how long the ray waited
  for its neighbours.
* ``sample``: Emulates whole tiles of an image, because hardware groups neighbouring pixels.
* ``loop_counts``, ``counters``: Operations, fetches and bytes of every pass of a call. The
  iterations of loops are counted by emulation.
* ``model``: Predicts seconds from counted work, with one fitted constant per card.
* ``trace``, ``issue``, ``table_reads``: The kernels that rays run, the lanes that groups of rays
  take for them, and the texels that they read, from passes that really ran.
* ``machines``, ``loop_costs``, ``local_store``: Times of machines with ray tracing units, and of
  the Cell, from these traces and from the static costs of kernels.
* ``methods_on_cards``: The methods that a card could have run.

The compiler needs the softpipe driver of Mesa 22.3. Without it, `compiler.not_countable` gives the
reason and `program.NotCountable` is raised. The cards and the model need no driver.
"""
